"""The System of rigid segments: forces, steps, and its compiled model."""
