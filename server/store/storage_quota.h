/// StorageQuota: storage used by the data directory, in total and by tenant, and its limits.
///
/// Counted are assets and scenes, for each tenant that keeps them; films on disk, with the images
/// stored beside them; and for an unfinished job the largest size of its film. The operator is
/// limited only by the total. The total refuses only assets: films are evicted to meet it
/// (JobService).
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include "core/base/mutex.h"
#include "core/base/result.h"
#include "server/store/database.h"

namespace server {

struct StorageLimits {
  std::uint64_t total_bytes = 0;   ///< 0: limited only by the disk.
  std::uint64_t tenant_bytes = 0;  ///< Limit of one tenant; 0: no limit.
};

class StorageQuota {
 public:
  enum class Kind : std::uint8_t { kAsset, kFilm };

  /// database must outlive this.
  StorageQuota(Database& database, StorageLimits limits) : database_(database), limits_(limits) {}

  /// Bytes reserved until the record that they are for is stored. The quota must outlive it.
  class Room {
   public:
    Room(Room&& other) noexcept
        : quota_(std::exchange(other.quota_, nullptr)),
          tenant_(std::move(other.tenant_)),
          kind_(other.kind_),
          bytes_(other.bytes_) {}
    Room& operator=(Room&&) = delete;
    Room(const Room&) = delete;
    Room& operator=(const Room&) = delete;
    ~Room();

    /// Grows the reservation to `bytes`. Errors: kOverQuota; the reservation is then unchanged.
    core::Status grow_to(std::uint64_t bytes);
    /// Covers a size that grows piece by piece; reserves ahead when there is space.
    core::Status cover(std::uint64_t bytes);

   private:
    friend class StorageQuota;
    Room(StorageQuota& quota, std::string tenant, Kind kind)
        : quota_(&quota), tenant_(std::move(tenant)), kind_(kind) {}
    StorageQuota* quota_;
    std::string tenant_;
    Kind kind_;
    std::uint64_t bytes_ = 0;
  };
  /// tenant: empty: the operator. Reserves nothing yet.
  Room room(std::string tenant, Kind kind) { return {*this, std::move(tenant), kind}; }

  struct Stored {
    std::uint64_t asset_bytes = 0;
    std::uint64_t film_bytes = 0;
  };
  /// Returns recorded bytes without reservations.
  core::Result<Stored> total() const;
  core::Result<Stored> of_tenant(std::string_view tenant) const;
  /// Returns whether the disk is full, regardless of the limits. Records can still be changed and
  /// deleted.
  bool is_disk_full() const { return !database_.reserve().is_taken(); }
  /// Checks the disk again. Returns true if there is space.
  bool has_disk_room() { return database_.reserve().take(); }
  const StorageLimits& limits() const { return limits_; }

 private:
  core::Result<std::uint64_t> asset_bytes() const;
  core::Status check_tenant(const Room& room, std::uint64_t more) const REQUIRES(mutex_);
  core::Status check_total(const Room& room, std::uint64_t more) const REQUIRES(mutex_);

  Database& database_;
  const StorageLimits limits_;
  mutable core::Mutex mutex_;  ///< Locked before the database's lock.
  std::map<std::string, std::uint64_t> promised_ GUARDED_BY(mutex_);  ///< Promised bytes by tenant.
  std::uint64_t promised_assets_ GUARDED_BY(mutex_) = 0;
};

}  // namespace server
