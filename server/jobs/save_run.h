/// Films of runs on their way to the disk.
#pragma once

#include "core/base/result.h"
#include "server/jobs/render_run.h"
#include "server/store/storage_quota.h"

namespace server {

/// RenderRun::save(), which leaves the reserve of a full disk to the records. Errors: kNoSpace,
/// kInternal.
inline core::Status save_run(RenderRun& run, StorageQuota& quota, bool is_memory_only,
                             bool is_final) {
  if (!is_memory_only && !quota.has_disk_room()) {
    return core::Error{core::ErrorCode::kNoSpace, "the disk is full", ""};
  }
  return run.save(is_final);
}

}  // namespace server
