//! Reads .glb and .gltf into a [`Model`](super::Model); every check of the input is here.
