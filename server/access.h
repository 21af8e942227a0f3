/// Access: on whose behalf a request is made, and what it may see and change.
///
/// Every job, scene, asset, comparison and webhook delivery belongs to a tenant; each key names
/// one. This is the only place that decides who may see what: stores and services take an Access
/// wherever they take an id, and treat objects that it does not see as nonexistent.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

namespace server {

struct Access {
  enum class Scope : std::uint8_t {
    kOwn,     ///< Objects of the tenant.
    kAll,     ///< Objects of all tenants: the operator, and keys with the scope `admin`.
    kShared,  ///< The same, as if one tenant had created everything.
  };

  std::string tenant = {};  ///< Empty: the operator.
  Scope scope = Scope::kOwn;
  int priority_max = 100;  ///< Highest priority of the jobs that it submits.

  /// For actions of the server itself.
  static Access operators() { return {.scope = Scope::kAll}; }
  static Access of(std::string tenant) { return {.tenant = std::move(tenant)}; }

  bool sees_all() const { return scope != Scope::kOwn; }
  bool is_shared() const { return scope == Scope::kShared; }
  /// Returns whether it may know that an object of that tenant exists.
  bool sees(std::string_view owner) const { return sees_all() || owner == tenant; }
  /// Returns whether names given by this tenant and by `owner` share one namespace.
  bool shares_names_with(std::string_view owner) const { return is_shared() || owner == tenant; }
};

}  // namespace server
