//! STEP 4: levels become a package on disk.
