//! An indexed triangle list with normals and texture coordinates, as it goes into the file.

use glam::{Vec2, Vec3};

/// Geometry of one primitive; lengths in metres.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Mesh {
    pub positions: Vec<Vec3>,
    pub normals: Vec<Vec3>,
    pub uvs: Vec<Vec2>,
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// Adds a vertex and returns its index.
    pub fn vertex(&mut self, position: Vec3, normal: Vec3, uv: Vec2) -> u32 {
        self.positions.push(position);
        self.normals.push(normal);
        self.uvs.push(uv);
        (self.positions.len() - 1) as u32
    }

    /// Adds the two triangles of a counter-clockwise quadrilateral.
    pub fn quad(&mut self, [a, b, c, d]: [u32; 4]) {
        self.triangles.push([a, b, c]);
        self.triangles.push([a, c, d]);
    }

    /// Adds a copy of another mesh.
    pub fn append(&mut self, other: &Mesh) {
        let base = self.positions.len() as u32;
        self.positions.extend_from_slice(&other.positions);
        self.normals.extend_from_slice(&other.normals);
        self.uvs.extend_from_slice(&other.uvs);
        let moved = other.triangles.iter().map(|t| t.map(|i| i + base));
        self.triangles.extend(moved);
    }

    /// Every triangle with vertices of its own and its face's normal.
    pub fn into_soup(self) -> Mesh {
        let mut soup = Mesh::default();
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|i| self.positions[i as usize]);
            let normal = (b - a).cross(c - a).normalize_or(Vec3::Y);
            let corners = triangle
                .map(|i| soup.vertex(self.positions[i as usize], normal, self.uvs[i as usize]));
            soup.triangles.push(corners);
        }
        soup
    }

    /// Tangents along +u (with the sign of the bitangent), as a normal map needs them: the mean of
    /// the triangles around a vertex (Lengyel, "Computing tangent space basis vectors", 2001).
    pub fn tangents(&self) -> Vec<[f32; 4]> {
        let mut sums = vec![Vec3::ZERO; self.positions.len()];
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|i| self.positions[i as usize]);
            let [p, q, r] = triangle.map(|i| self.uvs[i as usize]);
            let (q, r) = (q - p, r - p);
            // Up to a positive factor, which is all that a direction needs.
            let along = ((b - a) * r.y - (c - a) * q.y) * q.perp_dot(r).signum();
            let along = along.normalize_or_zero();
            for &i in triangle {
                sums[i as usize] += along;
            }
        }
        sums.iter()
            .zip(&self.normals)
            .map(|(&sum, &n)| {
                let fallback = n.any_orthonormal_vector();
                let t = (sum - n * n.dot(sum)).normalize_or(fallback);
                // No bark is mirrored: cross(normal, tangent) points up the image.
                [t.x, t.y, t.z, 1.0]
            })
            .collect()
    }

    /// The mesh moved by `-origin`.
    pub fn relative_to(mut self, origin: Vec3) -> Mesh {
        for p in &mut self.positions {
            *p -= origin;
        }
        self
    }
}
