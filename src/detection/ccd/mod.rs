//! Continuous collision detection of one pair moving on straight lines.
