//! Closest points and bounding volumes.
