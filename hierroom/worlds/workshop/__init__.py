"""The Workshop, a world without navigation: things on a bench are made into other things by rules."""
