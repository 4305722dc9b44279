"""What is done with a recipe: replay, sessions of the editor, jobs of the command line, recovery."""
