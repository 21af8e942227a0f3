/// StorageQuota: how much the data directory keeps, in all and for each tenant, and how much it
/// may.
///
/// What counts: assets and scenes, for each tenant that keeps them; films on the disk; and for a
/// job that has not ended the most that its film can take while it renders. The operator is bound
/// by the total alone. The total refuses assets only: films are evicted for it (JobService).
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
  std::uint64_t total_bytes = 0;   ///< 0: whatever the disk holds.
  std::uint64_t tenant_bytes = 0;  ///< Of one tenant; 0: any number.
};

class StorageQuota {
 public:
  enum class Kind : std::uint8_t { kAsset, kFilm };

  /// database must outlive this.
  StorageQuota(Database& database, StorageLimits limits) : database_(database), limits_(limits) {}

  /// Bytes that are promised to somebody until what they are for is on record. The quota outlives
  /// it.
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

    /// Makes it `bytes` large, if it is smaller. Errors: kOverQuota, and it stays as it was.
    core::Status grow_to(std::uint64_t bytes);
    /// The same for a size that grows piece by piece: takes some more where there is more.
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
  /// tenant: empty: the operator. Nothing is promised yet.
  Room room(std::string tenant, Kind kind) { return {*this, std::move(tenant), kind}; }

  struct Stored {
    std::uint64_t asset_bytes = 0;
    std::uint64_t film_bytes = 0;
  };
  /// On record, without promises.
  core::Result<Stored> total() const;
  core::Result<Stored> of_tenant(std::string_view tenant) const;
  /// Is the disk full, whatever the limits? Records can still be changed and deleted.
  bool is_disk_full() const { return !database_.reserve().is_taken(); }
  /// Looks again. True: there is room.
  bool has_disk_room() { return database_.reserve().take(); }
  const StorageLimits& limits() const { return limits_; }

 private:
  core::Result<std::uint64_t> asset_bytes() const;
  core::Status check_tenant(const Room& room, std::uint64_t more) const REQUIRES(mutex_);
  core::Status check_total(const Room& room, std::uint64_t more) const REQUIRES(mutex_);

  Database& database_;
  const StorageLimits limits_;
  mutable core::Mutex mutex_;  ///< Taken before the database's lock.
  std::map<std::string, std::uint64_t> promised_ GUARDED_BY(mutex_);  ///< By tenant.
  std::uint64_t promised_assets_ GUARDED_BY(mutex_) = 0;
};

}  // namespace server
