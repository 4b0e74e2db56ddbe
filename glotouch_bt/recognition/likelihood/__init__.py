"""Marginal likelihood of a TouchSet given an STL, against a background of other objects. Pure."""
