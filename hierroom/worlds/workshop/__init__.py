"""The Workshop: things are made of things on a bench, by rules; a world without navigation."""
