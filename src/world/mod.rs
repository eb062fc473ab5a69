//! Bodies by id, the step, queries.
