"""Many independent learners at once: their weights stacked, their products batched."""
