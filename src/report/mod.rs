//! STEP 5: reads the package back and measures it against the original.
