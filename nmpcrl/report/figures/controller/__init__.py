"""The controller: its plans, its action values, and the gradient of its value."""
