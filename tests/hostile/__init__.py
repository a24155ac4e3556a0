"""What hostile or mistaken machines and files try, and what has to come of it."""
