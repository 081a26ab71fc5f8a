"""What a learner does, from the few runs that a chapter trains."""
