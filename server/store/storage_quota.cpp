#include "server/store/storage_quota.h"

#include <utility>

#include "api/json/error_codes.h"

namespace server {

using core::Error;
using core::ErrorCode;
using core::Status;

namespace {

/// Reserved at a time for an upload of unknown size.
constexpr std::uint64_t kStepBytes = std::uint64_t{4} << 20U;

core::Result<std::uint64_t> sum_of(Statement& select) {
  return select.result(select.step() ? static_cast<std::uint64_t>(select.integer(0)) : 0);
}

core::Result<StorageQuota::Stored> stored(core::Result<std::uint64_t> assets,
                                          core::Result<std::uint64_t> films) {
  if (!assets || !films) {
    return assets ? films.error() : assets.error();
  }
  return StorageQuota::Stored{.asset_bytes = *assets, .film_bytes = *films};
}

}  // namespace

StorageQuota::Room::~Room() {
  if (quota_ == nullptr || bytes_ == 0) {
    return;
  }
  const core::MutexLock lock(quota_->mutex_);
  const auto promised = quota_->promised_.find(tenant_);
  promised->second -= bytes_;
  if (promised->second == 0) {
    quota_->promised_.erase(promised);
  }
  if (kind_ == Kind::kAsset) {
    quota_->promised_assets_ -= bytes_;
  }
}

Status StorageQuota::Room::grow_to(std::uint64_t bytes) {
  if (bytes <= bytes_) {
    return core::ok_status();
  }
  if (!quota_->has_disk_room()) {
    return Error{ErrorCode::kNoSpace, "the disk is full", ""};
  }
  const std::uint64_t more = bytes - bytes_;
  const core::MutexLock lock(quota_->mutex_);
  if (auto fits = quota_->check_tenant(*this, more); !fits) {
    return fits;
  }
  if (auto fits = quota_->check_total(*this, more); !fits) {
    return fits;
  }
  quota_->promised_[tenant_] += more;
  if (kind_ == Kind::kAsset) {
    quota_->promised_assets_ += more;
  }
  bytes_ = bytes;
  return core::ok_status();
}

Status StorageQuota::Room::cover(std::uint64_t bytes) {
  return bytes <= bytes_ || grow_to(bytes + kStepBytes) ? core::ok_status() : grow_to(bytes);
}

Status StorageQuota::check_tenant(const Room& room, std::uint64_t more) const {
  if (room.tenant_.empty() || limits_.tenant_bytes == 0) {
    return core::ok_status();
  }
  const auto kept = of_tenant(room.tenant_);
  if (!kept) {
    return kept.error();
  }
  const auto promised = promised_.find(room.tenant_);
  const std::uint64_t taken =
      kept->asset_bytes + kept->film_bytes + (promised == promised_.end() ? 0 : promised->second);
  if (taken + more <= limits_.tenant_bytes) {
    return core::ok_status();
  }
  return Error{api::kOverQuota,
               "this needs " + std::to_string(room.bytes_ + more) + " bytes; the tenant '" +
                   room.tenant_ + "' uses " + std::to_string(taken - room.bytes_) +
                   " already, and " + std::to_string(limits_.tenant_bytes) +
                   " are allowed (delete assets or jobs)",
               ""};
}

Status StorageQuota::check_total(const Room& room, std::uint64_t more) const {
  if (room.kind_ != Kind::kAsset || limits_.total_bytes == 0) {
    return core::ok_status();
  }
  const auto kept = asset_bytes();
  if (!kept) {
    return kept.error();
  }
  const std::uint64_t taken = *kept + promised_assets_;
  if (taken + more <= limits_.total_bytes) {
    return core::ok_status();
  }
  return Error{api::kOverQuota,
               "this needs " + std::to_string(room.bytes_ + more) +
                   " bytes; the server stores assets of " + std::to_string(taken - room.bytes_) +
                   ", and its limit is " + std::to_string(limits_.total_bytes),
               ""};
}

core::Result<std::uint64_t> StorageQuota::asset_bytes() const {
  auto session = database_.session();
  Statement select = session.prepare("SELECT COALESCE(SUM(bytes), 0) FROM assets");
  return sum_of(select);
}

core::Result<StorageQuota::Stored> StorageQuota::total() const {
  auto assets = asset_bytes();
  auto session = database_.session();
  Statement films = session.prepare("SELECT COALESCE(SUM(film_bytes), 0) FROM jobs WHERE film=1");
  return stored(std::move(assets), sum_of(films));
}

core::Result<StorageQuota::Stored> StorageQuota::of_tenant(std::string_view tenant) const {
  auto session = database_.session();
  Statement assets = session.prepare(
      "SELECT COALESCE(SUM(bytes), 0) FROM assets WHERE id IN"
      " (SELECT asset FROM asset_tenants WHERE tenant=?1 UNION"
      " SELECT asset FROM scene_tenants JOIN scene_files USING(scene) WHERE tenant=?1)");
  Statement films =
      session.prepare("SELECT COALESCE(SUM(stored_bytes), 0) FROM job_owners WHERE owner=?");
  return stored(sum_of(assets.bind(tenant)), sum_of(films.bind(tenant)));
}

}  // namespace server
