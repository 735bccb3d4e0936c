"""studies.face_off."""
