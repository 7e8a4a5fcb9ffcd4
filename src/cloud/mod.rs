//! STEP 2: a sub-tree becomes billboards, each with cost and error.
