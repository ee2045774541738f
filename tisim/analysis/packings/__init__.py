"""Measures of packings of bodies of any shape: contacts, order, pores."""
