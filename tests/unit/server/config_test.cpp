#include "server/config/config.h"

#include <filesystem>
#include <fstream>
#include <map>
#include <string_view>

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

TEST(Config, EmptyVariablesCountAsUnset) {
  const auto config =
      parse_config({}, [](const std::string& /*name*/) { return std::optional<std::string>(""); });
  ASSERT_TRUE(config) << config.error().where;
  EXPECT_EQ(server::config_text(*config), server::config_text(*parse({})));
}

TEST(Config, LinksOfServicesAreIgnoredWithAWarning) {
  for (const char* link : {"tcp://10.96.12.7:80", "udp://10.0.0.1:53"}) {
    const auto config = parse({}, {{"TESSERA_PORT", link}});
    ASSERT_TRUE(config);
    EXPECT_EQ(config->port, 8080);
    ASSERT_EQ(config->warnings.size(), 1U);
    EXPECT_NE(config->warnings.front().find("TESSERA_PORT"), std::string::npos);
  }
}

TEST(Config, HostsAndOriginsHaveOneSpelling) {
  const auto config =
      parse({"--hosts", " A.example, b.example:8080 ,[::1]", "--origins",
             "HTTPS://Shop.example/, http://two.example:80, https://c.example:444"});
  ASSERT_TRUE(config);
  EXPECT_EQ(config->hosts, (std::vector<std::string>{"a.example", "b.example:8080", "[::1]"}));
  EXPECT_EQ(parse({"--hosts", "a.example.,b_c.example.:80"})->hosts,
            (std::vector<std::string>{"a.example", "b_c.example:80"}));
  EXPECT_EQ(config->origins, (std::vector<std::string>{"https://shop.example", "http://two.example",
                                                       "https://c.example:444"}));
}

TEST(Config, PasswordsOfAddressesAreNotShown) {
  const char* secret = "secretpw";
  for (const char* url : {"http://u:secretpw@x:1", "u:secretpw@x", "nats//u:secretpw@x"}) {
    for (const char* flag : {"--hosts", "--origins", "--embed-origins", "--base-path"}) {
      const auto refused = parse({flag, url});
      ASSERT_FALSE(refused) << flag << ' ' << url;
      EXPECT_EQ(refused.error().message.find(secret), std::string::npos) << flag << ' ' << url;
    }
  }
  const auto config = parse({"--queue", "nats://u:secretpw@x:1"});
  ASSERT_TRUE(config);
  const std::string text = server::config_text(*config);
  EXPECT_NE(text.find("# queue = nats://***@x:1\n"), std::string::npos);
  EXPECT_EQ(text.find(secret), std::string::npos);
}

TEST(Config, BasePathsHaveNoDotSegments) {
  EXPECT_EQ(parse({"--base-path", "/a/b.c/"})->base_path, "/a/b.c");
  for (const char* path : {"/a/../b", "/..", "/./a", "/a/.", "a", "//a", "/a b"}) {
    EXPECT_FALSE(parse({"--base-path", path})) << path;
  }
}

TEST(Config, RefusesHostsAndOriginsThatCouldNeverMatch) {
  for (const char* host :
       {"https://a.example", "*.example", "a.example/", "a b", "a:port", "[a]", "a.example:70000",
        "a.example:0", ".example.org", "a..b", "-x", "a-.example", ".", ".."}) {
    EXPECT_FALSE(parse({"--hosts", host})) << host;
  }
  for (const char* origin : {"shop.example", "https://shop.example/path", "ftp://a.example",
                             "https://*.example", "https://", "https://a.example:0", "null"}) {
    EXPECT_FALSE(parse({"--origins", origin})) << origin;
  }
}

TEST(Config, KeysCanBeSent) {
  for (const char* flag : {"--key", "--worker-key", "--metrics-key"}) {
    for (const char* key : {" ", "\n", "a\nb", "a\x1b[2J", "\x7f"}) {
      EXPECT_FALSE(parse({flag, key})) << flag << " <" << key << '>';
    }
  }
  const auto config = parse({}, {{"TESSERA_KEY", "secret\r\n"}, {"TESSERA_METRICS_KEY", " m"}});
  ASSERT_TRUE(config);
  EXPECT_EQ(config->key, "secret");
  EXPECT_EQ(config->metrics_key, "m");
}

TEST(Config, FilesAreReadWholeOrRefused) {
  const test_support::TemporaryFolder folder;
  const std::string directory = folder.file("folder");
  std::filesystem::create_directory(directory);
  for (const char* flag : {"--config", "--key-file"}) {
    const auto refused = parse({flag, directory});
    ASSERT_FALSE(refused) << flag;
    EXPECT_NE(refused.error().message.find("directory"), std::string::npos);
    EXPECT_FALSE(parse({flag, folder.file("missing")})) << flag;
  }
  const std::string wide = folder.file("wide.conf");
  std::ofstream(wide) << std::string_view("\xFF\xFEp\0o\0", 6);
  const std::string unread = "/proc/self/mem";  // There is nothing at address 0.
  for (const std::string& file : {wide, unread}) {
    for (const char* flag : {"--config", "--key-file"}) {
      const auto refused = parse({flag, file});
      ASSERT_FALSE(refused) << flag << ' ' << file;
      EXPECT_EQ(refused.error().where, file) << flag;
    }
  }
  const std::string marked = folder.file("marked.conf");
  std::ofstream(marked) << "\xEF\xBB\xBFport = 8126\r\n";
  const auto config = parse({"--config", marked});
  ASSERT_TRUE(config) << config.error().message;
  EXPECT_EQ(config->port, 8126);
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
