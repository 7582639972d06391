"""Contact geometries that a pair names, each in one file that adds itself to `fsm.registry.GEOMETRIES`.

A file is loaded when a case names its geometry: ``geometry = "ring-on-plane"`` loads ``ring_on_plane.py``. Its form is that
of the file in docs/extend/contact_geometry.md, with imports from the modules of the package.
"""
