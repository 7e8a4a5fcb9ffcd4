//! Sweeps as tables for spreadsheets: one line a run, or one a variant. Names hold no comma.

use super::{Sweep, Whole};

impl Sweep {
    /// One line a run.
    pub fn csv(&self) -> String {
        let mut out = String::from(
            "name,seconds,cpu_seconds,peak_bytes,package_bytes,texture_bytes,triangles,f1_mean,f1_worst,shift_ratio,flip,area_ratio,on_front\n",
        );
        for r in &self.runs {
            out += &format!(
                "{},{:.3},{:.2},{},{},{},{},{:.5},{:.5},{:.4},{:.5},{:.5},{}\n",
                r.name,
                r.seconds,
                r.cpu_seconds,
                r.peak_bytes,
                r.package_bytes,
                r.texture_bytes,
                r.triangles,
                r.f1_mean,
                r.f1_worst,
                r.shift_ratio,
                r.flip,
                r.area_ratio,
                r.on_front
            );
        }
        out
    }
}

impl Whole {
    /// One line a variant.
    pub fn csv(&self) -> String {
        let mut out = String::from(
            "name,time_ratio,peak_ratio,package_ratio,texture_ratio,f1_mean,f1_difference,f1_difference_least,f1_worst,flip_difference,area_ratio,on_front\n",
        );
        for v in &self.variants {
            out += &format!(
                "{},{:.4},{:.4},{:.4},{:.4},{:.5},{:.5},{:.5},{:.5},{:.5},{:.5},{}\n",
                v.name,
                v.time_ratio,
                v.peak_ratio,
                v.package_ratio,
                v.texture_ratio,
                v.f1_mean,
                v.f1_difference,
                v.f1_difference_least,
                v.f1_worst,
                v.flip_difference,
                v.area_ratio,
                v.on_front
            );
        }
        out
    }
}
