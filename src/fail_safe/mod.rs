//! What is done when the iterations of a method do not reach a clean state: rigid zones, hold.
