#include "server/commands/keys_command.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include <nlohmann/json.hpp>

#include "api/answers/tenant_view.h"
#include "api/flags/flags.h"
#include "api/json/json.h"
#include "api/json/limits.h"
#include "api/json/time_text.h"
#include "core/base/check.h"
#include "server/auth/key_view.h"
#include "server/config/config.h"
#include "server/observe/clock.h"
#include "server/store/database.h"
#include "server/store/files.h"
#include "server/store/key_table.h"

namespace server {
namespace {

constexpr std::array<const char*, 3> kVerbs = {"add", "list", "remove"};

constexpr const char* kKeysText =
    "Adds, lists and removes the bearer keys of a server. `keys add NAME` prints a new key once; "
    "the data directory stores only its hash. `keys list` lists the keys, `keys remove ID` removes "
    "one. A running server applies changes within a second. Once a key exists, every request needs "
    "one.";

struct KeyFlags {
  std::vector<std::string> words;  ///< add NAME, list, or remove ID
  std::string data;
  std::string scopes;
  std::string tenant;
  int priority_max = 0;
  std::optional<int> rate_limit;
  std::optional<int> days;
  bool as_json = false;
};

int add(KeyTable& table, const KeyFlags& flags) {
  MadeKey made = make_key(flags.words[1]);
  made.row.created_at = unix_now();
  made.row.priority_max = flags.priority_max;
  made.row.rate_limit = flags.rate_limit;
  if (!flags.scopes.empty()) {
    CHECK(read_scopes(flags.scopes, made.row));
  }
  if (!flags.tenant.empty()) {
    made.row.tenant = flags.tenant;
  }
  if (flags.days) {
    made.row.expires_at = made.row.created_at + *flags.days * kDaySeconds;
  }
  if (const auto added = table.insert(made.row); !added) {
    return flags::complain("tessera keys", added.error(), flags::kFailed);
  }
  std::printf("%s\n", made.token.c_str());
  std::fprintf(stderr, "key %s for %s; it is not shown again\n", made.row.id.c_str(),
               made.row.name.c_str());
  return flags::kDone;
}

int list(KeyTable& table, const KeyFlags& flags) {
  const auto rows = table.list();
  if (!rows) {
    return flags::complain("tessera keys", rows.error(), flags::kFailed);
  }
  if (flags.as_json) {
    api::Json keys = api::Json::array();
    for (const KeyRow& row : *rows) {
      keys.push_back(api::key_part(key_view(row)));
    }
    std::printf("%s\n", api::dump({{"keys", std::move(keys)}}).c_str());
    return flags::kDone;
  }
  for (const KeyRow& row : *rows) {
    std::printf("%s  %-10s  %-16s  %s  %s  %s\n", row.id.c_str(), row.tenant.c_str(),
                scopes_text(row).c_str(), api::rfc3339(row.created_at).c_str(),
                row.expires_at ? api::rfc3339(*row.expires_at).c_str() : "never expires",
                row.name.c_str());
  }
  return flags::kDone;
}

int remove(KeyTable& table, const KeyFlags& flags) {
  const auto removed = table.remove(flags.words[1]);
  if (!removed) {
    return flags::complain("tessera keys", removed.error(), flags::kFailed);
  }
  if (!*removed) {
    return flags::complain("tessera keys",
                           {core::ErrorCode::kNotFound, "no such key", flags.words[1]},
                           flags::kFailed);
  }
  return flags::kDone;
}

core::Result<std::unique_ptr<Database>> open_database(const KeyFlags& flags) {
  const auto directory = data_directory(flags.data);
  if (!directory) {
    return directory.error();
  }
  if (const auto made = make_directories(*directory); !made) {
    return made.error();
  }
  return Database::open(*directory + "/tessera.db");
}

int change(const KeyFlags& flags) {
  const std::string& verb = flags.words.front();
  const std::size_t words = verb == "list" ? 1 : 2;
  if (std::find(kVerbs.begin(), kVerbs.end(), verb) == kVerbs.end() ||
      flags.words.size() != words) {
    return flags::complain("tessera keys",
                           {core::ErrorCode::kInvalidArgument,
                            "expected add NAME, list, or remove ID; see --help", ""},
                           flags::kWrongUsage);
  }
  auto database = open_database(flags);
  if (!database) {
    return flags::complain("tessera keys", database.error(), flags::kFailed);
  }
  KeyTable table(**database);
  return verb == "add"    ? add(table, flags)
         : verb == "list" ? list(table, flags)
                          : remove(table, flags);
}

/// Refuses values that `is_right` does not accept: "... is not a <words>".
CLI::Validator needs(const std::function<bool(const std::string&)>& is_right, std::string words) {
  return {[is_right, words = std::move(words)](const std::string& text) {
            return is_right(text) ? std::string() : '"' + text + "\" is not a " + words;
          },
          ""};
}

}  // namespace

int keys_command(const std::vector<std::string>& args) {
  KeyFlags given;
  CLI::App app(kKeysText, "tessera keys");
  app.add_option("COMMAND", given.words, "add NAME, list, or remove ID")
      ->type_name("COMMAND")
      ->expected(1, 2)
      ->required();
  app.add_option("--data", given.data, "The server's data directory.")->type_name("DIR");
  app.add_option("--scope", given.scopes,
                 "Scopes of an added key: read, write, admin or worker, separated by commas "
                 "(read,write). admin includes read and write for all tenants, and manages keys; "
                 "worker is for `tessera worker`.")
      ->type_name("SCOPES")
      ->check(needs(
          [](const std::string& text) {
            KeyRow row;
            return read_scopes(text, row);
          },
          "list of read, write, admin and worker"));
  app.add_option("--tenant", given.tenant,
                 "Tenant of an added key (a new one). To replace a key, give its tenant.")
      ->type_name("NAME")
      ->check(needs([](const std::string& text) { return api::is_tenant_name(text); },
                    "name of 1 to 64 letters, digits and ._-"));
  app.add_option("--max-priority", given.priority_max,
                 "Maximum priority of the new key's jobs (0).")
      ->type_name("N")
      ->check(flags::within(0, static_cast<double>(api::limits::kPriority)));
  app.add_option("--rate", given.rate_limit,
                 "Requests per minute of an added key; 0: no limit (the server's --rate-limit).")
      ->type_name("N")
      ->check(flags::within(0, api::limits::kKeyRate));
  app.add_option("--days", given.days, "Days until an added key expires (never).")
      ->type_name("N")
      ->check(flags::within(1, api::limits::kKeyDays));
  app.add_flag("--json", given.as_json, "Print the list as JSON.");
  return flags::parse_and_run(
      app, args, [&given] { return change(given); },
      [] {
        return flags::Choices{{"COMMAND", {kVerbs.begin(), kVerbs.end()}}};
      });
}

}  // namespace server
