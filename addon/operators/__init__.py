"""Operators of the add-on."""
