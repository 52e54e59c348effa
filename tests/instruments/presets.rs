//! What the instrument files say.
