//! From model, state and filters to contacts with body ids and persistent keys.
