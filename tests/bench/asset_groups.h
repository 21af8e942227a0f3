/// Ten glTF files under two maps, for tables about scenes that are not built in.
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "core/render/picture/view.h"
#include "tests/support/errors.h"

namespace bench {

struct AssetPlan {
  int renders = 40;  ///< a group
  int width = 64;    ///< 16 : 9
  int threads = 2;
  bool is_short = false;  ///< each file under one of the maps, true images of fewer samples
  std::string only;       ///< files whose names start with this
  std::string by;         ///< the integrator; empty: all
};

struct AssetGroup {
  std::string name;
  core::View view;  ///< by `path`
  test_support::Truth truth;
};

/// Calls visit() for each group. Returns false, and says so, if there is no folder of assets. True
/// images are kept in `folder`, which ends with a slash: delete them after changes of what is
/// rendered.
bool for_asset_groups(const AssetPlan& plan, const std::string& folder,
                      const std::function<void(const AssetGroup&)>& visit);

/// Returns the true image of a view, with so many samples, from a file in `folder` if there is one.
test_support::Truth kept_truth(const std::string& folder, const std::string& name,
                               const core::View& view, int samples, int threads);

/// Returns the view by another integrator, with the defaults of its options.
core::View view_by(core::View view, std::string_view integrator);

/// Returns the folder of a program, with a slash.
std::string folder_of(const char* program);

}  // namespace bench
