"""Views: the same environments in the forms that other libraries expect."""
