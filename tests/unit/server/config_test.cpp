#include "server/config.h"

#include <map>

#include <gtest/gtest.h>

#include "tests/unit/server/server_test_support.h"

namespace {

using server::parse_config;

core::Result<server::Config> parse(std::vector<std::string_view> args,
                                   const std::map<std::string, std::string>& variables = {}) {
  return parse_config(args, [&](const std::string& name) -> std::optional<std::string> {
    const auto found = variables.find(name);
    return found == variables.end() ? std::nullopt : std::optional<std::string>(found->second);
  });
}

TEST(Config, DefaultsMatchTheDocumentation) {
  const auto config = parse({});
  ASSERT_TRUE(config);
  EXPECT_EQ(config->port, 8080);
  EXPECT_EQ(config->listen, "127.0.0.1");
  EXPECT_EQ(config->grace_seconds, 10);
  EXPECT_GE(config->streams_max, 2048);
  EXPECT_FALSE(config->demo);
}

TEST(Config, FlagOverridesItsVariable) {
  const auto config = parse({"--port", "9", "--max-queue=3", "--demo"},
                            {{"TESSERA_PORT", "7"}, {"TESSERA_MAX_STREAMS", "12"}});
  ASSERT_TRUE(config);
  EXPECT_EQ(config->port, 9);
  EXPECT_EQ(config->queue_max, 3);
  EXPECT_EQ(config->streams_max, 12);
  EXPECT_TRUE(config->demo);
}

TEST(Config, ReadsBytesAndPercents) {
  const auto config = parse({"--max-upload", "3M", "--disk-limit", "50%"});
  ASSERT_TRUE(config);
  EXPECT_EQ(config->upload_bytes_max, 3U << 20U);
  EXPECT_EQ(config->disk_limit.percent, 50);
  EXPECT_EQ(parse({"--disk-limit", "2G"})->disk_limit.bytes, 2ULL << 30U);
  EXPECT_EQ(parse({"--disk-limit", "2G"})->disk_limit.percent, 0);
  EXPECT_EQ(parse({})->quota_storage.percent, 50);
  EXPECT_EQ(parse({"--quota-storage", "0"})->quota_storage.percent, 0);
}

TEST(Config, FaultNamesTheFlagAndTheRange) {
  EXPECT_EQ(parse({"--port", "70000"}).error().message, "--port: 70000 is outside [0, 65535]");
  EXPECT_EQ(parse({"--memory", "101%"}).error().message, "--memory: 101 is outside [1, 100]");
  EXPECT_EQ(parse({"--prot", "1"}).error().message,
            "there is no option --prot; did you mean --port?");
  EXPECT_EQ(parse({"here"}).error().message, "\"here\" is an unexpected argument");
  EXPECT_EQ(parse({}, {{"TESSERA_PORT", "x"}}).error().where, "TESSERA_PORT");
  for (const auto& args :
       std::vector<std::vector<std::string_view>>{{"--port"},
                                                  {"--grace", "nan"},
                                                  {"--log-level", "loud"},
                                                  {"--demo=perhaps"},
                                                  {"--memory", "2X"},
                                                  {"--max-upload", "99999999999999T"}}) {
    const auto refused = parse(args);
    ASSERT_FALSE(refused) << args.front();
    const auto name = args.front().substr(0, args.front().find('='));
    EXPECT_NE(refused.error().message.find(name), std::string::npos) << refused.error().message;
  }
}

TEST(Config, ValueMayBeEmptyOrLookLikeAList) {
  EXPECT_EQ(parse({"--audit-log=", "--port=9"})->audit_log, "");
  EXPECT_EQ(parse({"--key", "[a,b]"})->key, "[a,b]");
  EXPECT_EQ(parse({"--key=a=b="})->key, "a=b=");
  EXPECT_EQ(parse({"--hosts", "a,,b", "--port", "9"})->hosts, (std::vector<std::string>{"a", "b"}));
  EXPECT_EQ(parse({"--port", "7", "--port", "9"})->port, 9);
}

TEST(Config, EmptyVariablesCountAsUnset) {
  const auto config = parse({}, {{"TESSERA_PORT", ""},
                                 {"TESSERA_THREADS", ""},
                                 {"TESSERA_MEMORY", ""},
                                 {"TESSERA_LISTEN", ""},
                                 {"TESSERA_DEMO", ""}});
  ASSERT_TRUE(config);
  EXPECT_EQ(config->port, 8080);
  EXPECT_EQ(config->listen, "127.0.0.1");
}

TEST(Config, ListsAreTrimmedAndOriginsNormal) {
  const auto config = parse({"--hosts", "a.example, B.example", "--origins",
                             " https://Shop.example/ ,HTTP://two.example:80,https://[::1]:8443"});
  ASSERT_TRUE(config);
  EXPECT_EQ(config->hosts, (std::vector<std::string>{"a.example", "b.example"}));
  EXPECT_EQ(config->origins, (std::vector<std::string>{"https://shop.example", "http://two.example",
                                                       "https://[::1]:8443"}));
}

TEST(Config, RefusesWhatCanNeverMatch) {
  for (const char* host : {"https://render.example.org", "*.example.org", "a b", "a/b", "a:x"}) {
    EXPECT_FALSE(parse({"--hosts", host})) << host;
  }
  for (const char* origin : {"shop.example", "https://shop.example/path", "https://*.example",
                             "https://me@shop.example", "null", "https://"}) {
    EXPECT_FALSE(parse({"--origins", origin})) << origin;
  }
}

TEST(Config, FilesAreReadWholeOrRefused) {
  test_support::TemporaryFolder folder;
  const auto refused = parse({"--config", folder.path()});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().message, "is a directory, not a file");
  EXPECT_FALSE(parse({"--key-file", folder.path()}));
  const std::string path = folder.file("bom.conf");
  test_support::write_file(path, "\xef\xbb\xbfport = 8126\n");
  const auto config = parse({"--config", path});
  ASSERT_TRUE(config) << config.error().message;
  EXPECT_EQ(config->port, 8126);
}

TEST(Config, DataDirectoryDependsOnTheUser) {
  EXPECT_EQ(parse({}, {{"XDG_DATA_HOME", "/x"}, {"HOME", "/h"}})->data_dir, "/x/tessera");
  EXPECT_EQ(parse({}, {{"HOME", "/h"}})->data_dir, "/h/.local/share/tessera");
  EXPECT_EQ(parse({"--data", "/d"}, {{"HOME", "/h"}})->data_dir, "/d");
}

TEST(Config, HelpListsEveryFlagWithItsVariable) {
  const std::string help = server::config_help();
  for (const char* text :
       {"--port", "TESSERA_PORT", "--max-queue", "TESSERA_MAX_QUEUE", "--demo"}) {
    EXPECT_NE(help.find(text), std::string::npos) << text;
  }
}

TEST(Config, RecognisesLoopback) {
  for (const char* name : {"127.0.0.1", "127.9.9.9", "localhost", "::1", "[::1]"}) {
    EXPECT_TRUE(server::is_loopback(name)) << name;
  }
  for (const char* name :
       {"0.0.0.0", "10.0.0.1", "example.org", "127.0.0.1.example.org", "127.evil", ""}) {
    EXPECT_FALSE(server::is_loopback(name)) << name;
  }
}

}  // namespace
