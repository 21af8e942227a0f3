/// Coverage of the error intervals of images of scenes that are not built in.
#pragma once

namespace bench {

struct AssetPlan {
  int renders = 40;
  int width = 64;
  int threads = 2;
  bool is_short = false;  ///< one map, one sample count
};

/// Measures ten glTF files under two maps with path, bdpt, mlt and sppm: plain images, images
/// without fireflies and denoised ones (`mixed`, statistical), against references of path. Prints a
/// line per group and the totals. Returns false if there is no folder of assets.
bool measure_asset_coverage(const AssetPlan& plan);

}  // namespace bench
