#include "server/keys_command.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include <nlohmann/json.hpp>

#include "api/json.h"
#include "api/limits.h"
#include "api/time_text.h"
#include "server/command_flags.h"
#include "server/key_view.h"
#include "server/observe/clock.h"
#include "server/store/database.h"
#include "server/store/files.h"
#include "server/store/key_table.h"

namespace server {
namespace {

constexpr int kDone = 0;
constexpr int kFailed = 1;
constexpr int kWrongUsage = 2;
constexpr double kDaySeconds = 24 * 3600;

constexpr std::array kFlags = {
    CommandFlag{"data", "DIR", "The server's data directory."},
    CommandFlag{
        "scope", "SCOPES",
        "What an added key may do: read, write, or admin, with commas between (read,write). "
        "admin is both, for the work of all tenants, and manages keys."},
    CommandFlag{
        "tenant", "NAME",
        "Whose work an added key sees and makes (its own). A key that replaces another names "
        "the tenant of that one."},
    CommandFlag{"max-priority", "N", "Highest priority of an added key's jobs (0)."},
    CommandFlag{"rate", "N",
                "Requests a minute of an added key, 0 for any number (the server's --rate-limit)."},
    CommandFlag{"days", "N", "An added key expires after so many days (never)."},
    CommandFlag{"json", "", "Print the list as JSON."},
};
constexpr std::array<std::string_view, 3> kVerbs = {"add", "list", "remove"};
constexpr CommandText kText = {
    .text =
        "Adds, lists and removes the bearer keys of a server: `keys add NAME` prints a new key, "
        "once; the data "
        "directory keeps its hash only. `keys list`; `keys remove ID`. A running server sees "
        "changes within a "
        "second. As soon as there is a key, requests need one.",
    .operand = "COMMAND",
    .operand_text = "add NAME, list, or remove ID",
    .flags = kFlags,
    .operand_choices = kVerbs,
};

int complain(const core::Error& error, int code) {
  std::fprintf(stderr, "tessera keys: %s%s%s\n", error.where.c_str(),
               error.where.empty() ? "" : ": ", error.message.c_str());
  return code;
}

int wrong_usage(const std::string& message, const std::string& where) {
  return complain({core::ErrorCode::kInvalidArgument, message, where}, kWrongUsage);
}

std::optional<int> whole_number(const std::string& text, int max) {
  int value = 0;
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool ok =
      code == std::errc() && end == text.data() + text.size() && value >= 0 && value <= max;
  return ok ? std::optional<int>(value) : std::nullopt;
}

int add(KeyTable& table, const CommandFlags& flags) {
  MadeKey made = make_key(flags.words[1]);
  made.row.created_at = unix_now();
  for (const auto& [name, value] : flags.values) {
    if (name == "scope") {
      if (!read_scopes(value, made.row)) {
        return wrong_usage("\"" + value + "\" is not a list of read, write and admin", "--scope");
      }
    } else if (name == "tenant") {
      if (!is_tenant_name(value)) {
        return wrong_usage("\"" + value + "\" is not 1 to 64 letters, digits and ._-", "--tenant");
      }
      made.row.tenant = value;
    } else if (name == "max-priority") {
      const auto most = whole_number(value, static_cast<int>(api::limits::kPriority));
      if (!most) {
        return wrong_usage("\"" + value + "\" is no whole number up to 100", "--max-priority");
      }
      made.row.priority_max = *most;
    } else if (name == "rate") {
      made.row.rate_limit = whole_number(value, 100'000'000);
      if (!made.row.rate_limit) {
        return wrong_usage("\"" + value + "\" is no whole number up to 100000000", "--rate");
      }
    } else if (name == "days") {
      const auto days = whole_number(value, 36500);
      if (!days || *days == 0) {
        return wrong_usage("\"" + value + "\" is no whole number from 1 to 36500", "--days");
      }
      made.row.expires_at = made.row.created_at + *days * kDaySeconds;
    }
  }
  if (const auto added = table.insert(made.row); !added) {
    return complain(added.error(), kFailed);
  }
  std::printf("%s\n", made.token.c_str());
  std::fprintf(stderr, "key %s for %s; it is not shown again\n", made.row.id.c_str(),
               made.row.name.c_str());
  return kDone;
}

int list(KeyTable& table, const CommandFlags& flags) {
  const auto rows = table.list();
  if (!rows) {
    return complain(rows.error(), kFailed);
  }
  if (flags.switches.count("json") != 0) {
    api::Json keys = api::Json::array();
    for (const KeyRow& row : *rows) {
      keys.push_back(api::key_part(key_view(row)));
    }
    std::printf("%s\n", api::dump({{"keys", std::move(keys)}}).c_str());
    return kDone;
  }
  for (const KeyRow& row : *rows) {
    std::printf("%s  %-10s  %-16s  %s  %s  %s\n", row.id.c_str(), row.tenant.c_str(),
                scopes_text(row).c_str(), api::rfc3339(row.created_at).c_str(),
                row.expires_at ? api::rfc3339(*row.expires_at).c_str() : "never expires",
                row.name.c_str());
  }
  return kDone;
}

int remove(KeyTable& table, const CommandFlags& flags) {
  const auto removed = table.remove(flags.words[1]);
  if (!removed) {
    return complain(removed.error(), kFailed);
  }
  if (!*removed) {
    return complain({core::ErrorCode::kNotFound, "there is no such key", flags.words[1]}, kFailed);
  }
  return kDone;
}

core::Result<std::unique_ptr<Database>> open_database(const CommandFlags& flags) {
  const auto directory = data_directory(flags);
  if (!directory) {
    return directory.error();
  }
  if (const auto made = make_directories(*directory); !made) {
    return made.error();
  }
  return Database::open(*directory + "/tessera.db");
}

}  // namespace

int keys_command(std::span<const std::string_view> args) {
  const auto flags = parse_command_flags(args, kFlags);
  if (!flags) {
    return complain(flags.error(), kWrongUsage);
  }
  if (print_command_text(*flags, kText)) {
    return kDone;
  }
  const std::string verb = flags->words.empty() ? "" : flags->words.front();
  const std::size_t words = verb == "list" ? 1 : 2;
  if (std::find(kVerbs.begin(), kVerbs.end(), verb) == kVerbs.end() ||
      flags->words.size() != words) {
    return wrong_usage("expected add NAME, list, or remove ID; see --help", "");
  }
  auto database = open_database(*flags);
  if (!database) {
    return complain(database.error(), kFailed);
  }
  KeyTable table(**database);
  return verb == "add"    ? add(table, *flags)
         : verb == "list" ? list(table, *flags)
                          : remove(table, *flags);
}

}  // namespace server
