"""Check that the slow dynamic pull is slow enough."""
