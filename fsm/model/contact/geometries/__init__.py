"""Contact geometries that a pair names, each in one file that adds itself (`fsm.registry.add_geometry`).

A file is loaded when a case names its geometry: ``geometry = "ring-on-plane"`` loads ``ring_on_plane.py``. See
docs/extend/contact_geometry.md; a file here has the same form.
"""
