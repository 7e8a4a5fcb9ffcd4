//! STEP 3: billboards become levels of detail.

pub mod wood;
