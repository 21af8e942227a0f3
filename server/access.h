/// Access: in whose name something is asked, and what that lets one see and change.
///
/// Every job, scene, asset, comparison and webhook delivery belongs to a tenant; each key names
/// one. This is the only place with the rule of who may see what: stores and services take an
/// Access wherever they take an id, and tell of what it does not see as if it did not exist.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

namespace server {

struct Access {
  enum class Scope : std::uint8_t {
    kOwn,     ///< What the tenant made.
    kAll,     ///< What anybody made: the operator, and keys with the scope `admin`.
    kShared,  ///< The same, as if one tenant had made everything.
  };

  std::string tenant = {};  ///< Empty: the operator's.
  Scope scope = Scope::kOwn;
  int priority_max = 100;  ///< Of the jobs that it submits.

  /// For what the server does by itself.
  static Access operators() { return {.scope = Scope::kAll}; }
  static Access of(std::string tenant) { return {.tenant = std::move(tenant)}; }

  bool sees_all() const { return scope != Scope::kOwn; }
  bool is_shared() const { return scope == Scope::kShared; }
  /// May it know that something of that tenant exists?
  bool sees(std::string_view owner) const { return sees_all() || owner == tenant; }
  /// Are names that this tenant gives and names that `owner` gave the same names?
  bool shares_names_with(std::string_view owner) const { return is_shared() || owner == tenant; }
};

}  // namespace server
