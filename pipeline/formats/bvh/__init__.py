"""Reading and writing of BVH files; joints of a walker as a character."""

from pipeline.formats.bvh.reading import read
from pipeline.formats.bvh.writing import Character, Names, character, write

__all__ = ["Character", "Names", "character", "read", "write"]
