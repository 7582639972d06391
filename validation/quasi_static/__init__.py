"""Is the slow dynamic pull slow enough?"""
