"""What makes an answer right: a module for each chapter, a function for each of its exercises."""
