"""What each task of an exercise asks of an answer, by its properties and on inputs that are drawn at random."""
