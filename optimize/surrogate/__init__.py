"""Surrogates: what a search believes of designs that it has not run, from those that it has."""
