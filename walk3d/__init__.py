"""3D walks from one camera: what this project builds on the methods of the four papers."""
