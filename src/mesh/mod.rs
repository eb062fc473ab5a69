//! Triangle meshes, shapes and their validation.
