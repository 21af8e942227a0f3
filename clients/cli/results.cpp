// The verbs for results of jobs: merge, compare, meter.
#include <algorithm>
#include <array>
#include <cstdio>
#include <string_view>
#include <utility>
#include <vector>

#include "clients/cli/api_client.h"
#include "clients/cli/command.h"
#include "clients/cli/files.h"
#include "clients/cli/follow.h"
#include "clients/cli/job_json.h"
#include "clients/cli/upload.h"

namespace cli {
namespace {

constexpr std::size_t kUuidLength = 36;

/// Returns the id of a job or an asset: uploads files, and treats anything else as a job's id.
core::Result<std::string> id_of(ApiClient& client, const std::string& name) {
  if (is_file(name)) {
    return upload_asset(client, name);
  }
  constexpr std::size_t kSha256Digits = 64;
  if (name.size() == kSha256Digits) {
    return name;
  }
  if (name.size() != kUuidLength && name != "latest") {
    return core::Error{core::ErrorCode::kNotFound,
                       "there is no such file, and it is not the id of a job", name};
  }
  const auto path = job_path(client, name);
  if (!path) {
    return path.error();
  }
  return path->substr(path->rfind('/') + 1);
}

/// Translates the server's pointers, "/films/1" or "/b", to the arguments.
core::Error with_argument(core::Error error,
                          const std::vector<std::pair<std::string, std::string>>& pointers) {
  for (const auto& [pointer, argument] : pointers) {
    if (const std::size_t at = error.message.find(pointer + ": "); at != std::string::npos) {
      error.message.insert(at + pointer.size(), " (" + argument + ")");
    }
  }
  return error;
}

int merge_films(const ServerFlags& server, const std::vector<std::string>& films, bool json) {
  auto client = ApiClient::connect(server.url, server.key);
  if (!client) {
    return complain("merge", client.error());
  }
  Json ids = Json::array();
  std::vector<std::pair<std::string, std::string>> pointers;
  for (const std::string& film : films) {
    pointers.emplace_back("/films/" + std::to_string(pointers.size()), film);
    const auto id = id_of(**client, film);
    if (!id) {
      return complain("merge", id.error());
    }
    ids.push_back(*id);
  }
  const auto reply =
      (*client)->post("/v1/films/merge", Json{{"films", ids}}.dump(), "application/json");
  if (!reply) {
    return complain("merge", with_argument(reply.error(), pointers));
  }
  const Json job = parse_object(reply->body);
  std::printf("%s\n", json ? job.dump(2).c_str() : text_at(job, "id").c_str());
  return kDone;
}

std::string figure(const Json& object, const char* name) {
  const auto found = object.find(name);
  if (found == object.end() || !found->is_number()) {
    return "unknown";
  }
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", found->get<double>());
  return text;
}

void print_figures(const Json& comparison) {
  const Json& bias = object_in(comparison, "bias");
  const Json& z = object_in(comparison, "z");
  std::printf("MSE       %s\n", figure(comparison, "mse").c_str());
  std::printf("relMSE    %s\n", figure(comparison, "relmse").c_str());
  std::printf("FLIP      %s\n", figure(comparison, "flip").c_str());
  std::printf("bias      %s (%s to %s)\n", figure(bias, "value").c_str(),
              figure(bias, "low").c_str(), figure(bias, "high").c_str());
  std::printf("z         mean %s, variance %s, share beyond 3 %s\n", figure(z, "mean").c_str(),
              figure(z, "variance").c_str(), figure(z, "share_above_3").c_str());
}

/// Image files with display values clip at white: brighter pixels of the job appear as differences.
void warn_of_display_values(const std::vector<std::string>& names) {
  constexpr std::array<std::string_view, 5> kDisplay = {"png", "jpg", "jpeg", "webp", "avif"};
  for (const std::string& name : names) {
    if (is_file(name) &&
        std::find(kDisplay.begin(), kDisplay.end(), extension_of(name)) != kDisplay.end()) {
      std::fprintf(stderr,
                   "warning: %s has display values, which clip at white: brighter values count as "
                   "a difference. Only FLIP is valid for it; for the others compare an EXR.\n",
                   name.c_str());
    }
  }
}

/// One side of a comparison.
struct Side {
  std::string picture;
  std::string denoise;  ///< empty: the server's default
};

int compare_pictures(const ServerFlags& server, const Side& left, const Side& right, bool json) {
  const std::string& a = left.picture;
  const std::string& b = right.picture;
  auto client = ApiClient::connect(server.url, server.key);
  if (!client) {
    return complain("compare", client.error());
  }
  const auto first = id_of(**client, a);
  const auto second = first ? id_of(**client, b) : first;
  if (!second) {
    return complain("compare", second.error());
  }
  warn_of_display_values({a, b});
  Json request = {{"a", *first}, {"b", *second}};
  if (!left.denoise.empty()) {
    request["a_denoise"] = left.denoise;
  }
  if (!right.denoise.empty()) {
    request["b_denoise"] = right.denoise;
  }
  const auto reply = (*client)->post("/v1/comparisons", request.dump(), "application/json");
  if (!reply) {
    return complain("compare", with_argument(reply.error(), {{"/a", a}, {"/b", b}}));
  }
  const Json comparison = parse_object(reply->body);
  if (json) {
    std::printf("%s\n", comparison.dump(2).c_str());
    return kDone;
  }
  print_figures(comparison);
  for (const char* map : {"difference", "z", "flip"}) {
    std::printf("%-9s %s%s\n", map, (*client)->url().c_str(),
                text_at(object_in(comparison, "links"), map).c_str());
  }
  return kDone;
}

int print_meter(const ServerFlags& server, const std::string& id, bool json) {
  return with_job("meter", server, id, [json](ApiClient& client, const std::string& path) {
    const auto reply = client.get(path + (json ? "/meter" : "/meter.csv"));
    if (!reply) {
      return core::Status(reply.error());
    }
    std::printf("%s",
                json ? (parse_object(reply->body).dump(2) + "\n").c_str() : reply->body.c_str());
    return core::ok_status();
  });
}

}  // namespace

int merge(const Args& args) {
  CLI::App app("Merges films of the same image into a new job, and prints its id.",
               "tessera merge");
  ServerFlags server;
  std::vector<std::string> films;
  bool json = false;
  app.add_option("film", films, "Jobs, or files written by `fetch --film`")
      ->required()
      ->type_name("ID|FILE...");
  app.add_flag("--json", json, "Print the job as JSON");
  add_server_flags(app, server);
  return parse_and_run(app, args, [&] { return merge_films(server, films, json); });
}

int compare(const Args& args) {
  CLI::App app("Compares two jobs, or a job and an image; the second is the reference.",
               "tessera compare");
  ServerFlags server;
  Side a;
  Side b;
  bool json = false;
  app.add_option("a", a.picture, "Job or image file")->required()->type_name("ID|FILE");
  app.add_option("b", b.picture, "Job or image file")->required()->type_name("ID|FILE");
  app.add_option("--a-denoise", a.denoise, "Image of job a: off, mixed, full, video")
      ->type_name("MODE");
  app.add_option("--b-denoise", b.denoise, "Image of job b: off, mixed, full, video")
      ->type_name("MODE");
  app.add_flag("--json", json, "Print the comparison as JSON");
  add_server_flags(app, server);
  return parse_and_run(app, args, [&] { return compare_pictures(server, a, b, json); });
}

int meter(const Args& args) {
  CLI::App app("Prints the current readings of a job's meter as CSV.", "tessera meter");
  ServerFlags server;
  std::string id = "latest";
  bool json = false;
  app.add_option("id", id, "Job (the newest)")->type_name("ID");
  app.add_flag("--json", json, "Print JSON");
  add_server_flags(app, server);
  return parse_and_run(app, args, [&] { return print_meter(server, id, json); });
}

}  // namespace cli
