"""Views: the same environments in the form that other libraries expect."""
