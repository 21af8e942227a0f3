/// Coverage of the error intervals of images of scenes that are not built in.
#pragma once

#include <string>

#include "tests/bench/asset_groups.h"

namespace bench {

/// Measures path, bdpt, mlt and sppm where they support the scene: plain images, images without
/// fireflies and denoised ones (`mixed` and `full`, statistical), against references of path.
/// Prints a line per group and the totals. Returns false if there is no folder of assets. folder:
/// as for for_asset_groups().
bool measure_asset_coverage(const AssetPlan& plan, const std::string& folder);

}  // namespace bench
