"""A pytest plugin that makes llvmlite refuse vectors, as another version may."""

from llvmlite import ir


def refuse(*arguments, **options):
    raise NotImplementedError("there are no vectors")


ir.VectorType.__init__ = refuse
