// Rules of /openapi.json without which commonly used generators of clients (openapi-generator,
// oapi-codegen, openapi-python-client) make code that does not compile or refuses valid answers.
// tests/clients/run runs the generators themselves.
#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <limits>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "api/answers/server_view.h"
#include "api/openapi.h"
#include "api/schema_parts.h"

namespace {

using api::Json;
using Faults = std::vector<std::string>;

const Json& document() {
  static const Json kDocument =
      api::openapi_document({{{"cornell-box", "x"}}, {{"png", "image/png"}}, {"srgb"}, {}}, "1");
  return kDocument;
}

/// Calls visit(pointer, node) for all nodes.
template <typename Visit>
void each_node(const Json& node, const Visit& visit, const std::string& pointer = "") {
  visit(pointer, node);
  if (node.is_object()) {
    for (const auto& member : node.items()) {
      each_node(member.value(), visit, api::join_pointer(pointer, member.key()));
    }
  } else if (node.is_array()) {
    for (std::size_t i = 0; i < node.size(); ++i) {
      each_node(node[i], visit, pointer + "/" + std::to_string(i));
    }
  }
}

bool has_type(const Json& node, std::string_view type) {
  if (!node.is_object() || !node.contains("type")) {
    return false;
  }
  const Json& types = node["type"];
  return types == type ||
         (types.is_array() && std::find(types.begin(), types.end(), type) != types.end());
}

/// Objects with members that are not components: where they may be null, Go and Python refuse it.
Faults nameless_objects(const Json& schemas) {
  Faults faults;
  each_node(schemas, [&](const std::string& pointer, const Json& node) {
    const bool is_component = std::count(pointer.begin(), pointer.end(), '/') == 1;
    const bool is_schema = !pointer.ends_with("/properties") && !pointer.ends_with("/examples");
    if (is_schema && !is_component && has_type(node, "object") && node.contains("properties")) {
      faults.push_back(pointer);
    }
  });
  return faults;
}

/// Numbers without a format, or whose format is too small: Go reads them into 32 bits.
Faults narrow_numbers(const Json& of) {
  Faults faults;
  each_node(of, [&](const std::string& pointer, const Json& node) {
    if (has_type(node, "integer")) {
      constexpr auto kMost = double{std::numeric_limits<std::int32_t>::max()};
      const bool fits = node.contains("minimum") && node.contains("maximum") &&
                        node["minimum"].get<double>() >= -kMost &&
                        node["maximum"].get<double>() <= kMost;
      const Json format = node.value("format", Json());
      if (format != "int64" && !(fits && format == "int32")) {
        faults.push_back(pointer);
      }
    } else if (has_type(node, "number") && node.value("format", Json()) != "double") {
      faults.push_back(pointer);
    }
  });
  return faults;
}

/// Names that mean the same to a generator: it capitalises each word, and Go adds constructors
/// `NewX` and types `NullableX`. `Objects` and its like are classes that generated Java imports.
Faults colliding_names(const Json& schemas) {
  constexpr std::array kTaken = {"Arrays", "Boolean",   "Class",     "Collections", "Double",
                                 "Error",  "Exception", "Integer",   "List",        "Locale",
                                 "Long",   "Map",       "Number",    "Object",      "Objects",
                                 "Set",    "String",    "StringUtil"};
  Faults faults;
  std::set<std::string> seen(kTaken.begin(), kTaken.end());
  for (const auto& schema : schemas.items()) {
    std::string name;
    bool starts = true;
    for (const char c : schema.key()) {
      const bool is_part = std::isalnum(static_cast<unsigned char>(c)) != 0;
      if (is_part) {
        name += starts ? static_cast<char>(std::toupper(static_cast<unsigned char>(c))) : c;
      }
      starts = !is_part;
    }
    for (const std::string& made : {name, "New" + name, "Nullable" + name}) {
      if (!seen.insert(made).second) {
        faults.push_back(schema.key());
      }
    }
  }
  return faults;
}

/// Components that differ only in their description.
Faults repeated_components(const Json& schemas) {
  Faults faults;
  std::set<std::string> seen;
  for (const auto& schema : schemas.items()) {
    Json bare = schema.value();
    bare.erase("description");
    bare.erase("examples");
    if (bare.contains("properties") && !seen.insert(api::dump(bare)).second) {
      faults.push_back(schema.key());
    }
  }
  return faults;
}

/// Go makes a constant of each value of an enumeration with a name, named by the value alone.
Faults colliding_values(const Json& schemas) {
  Faults faults;
  std::set<std::string> seen;
  for (const auto& schema : schemas.items()) {
    for (const Json& value : schema.value().value("enum", Json::array())) {
      if (!seen.insert(api::dump(value)).second) {
        faults.push_back(schema.key());
      }
    }
  }
  return faults;
}

/// Defaults of parameters with a choice of types: Go assigns the number to a struct.
Faults defaults_of_choices(const Json& paths) {
  Faults faults;
  each_node(paths, [&](const std::string& pointer, const Json& node) {
    if (node.is_object() && node.contains("anyOf") && node.contains("default")) {
      faults.push_back(pointer);
    }
  });
  return faults;
}

/// Parameters of one operation whose names differ only in case: Go makes two members of one name.
Faults colliding_parameters(const Json& paths) {
  Faults faults;
  each_node(paths, [&](const std::string& pointer, const Json& node) {
    if (!pointer.ends_with("/parameters")) {
      return;
    }
    std::set<std::string> seen;
    for (const Json& parameter : node) {
      std::string name = parameter.value("x-go-name", parameter["name"].get<std::string>());
      for (char& c : name) {
        c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
      }
      if (!seen.insert(name).second) {
        faults.push_back(pointer + "/" + name);
      }
    }
  });
  return faults;
}

const Json& schemas() { return document()["components"]["schemas"]; }

TEST(GeneratedClients, EachObjectIsAComponent) {
  EXPECT_EQ(nameless_objects(schemas()), Faults());
  EXPECT_EQ(nameless_objects(Json::parse(
                R"({"Job":{"type":"object","properties":{"crop":{"type":["object","null"],)"
                R"("properties":{"x":{"type":"integer"}}}}}})")),
            Faults({"/Job/properties/crop"}));
}

TEST(GeneratedClients, EachNumberHasAFormatThatHoldsIt) {
  EXPECT_EQ(narrow_numbers(document()), Faults());
  EXPECT_EQ(narrow_numbers(Json::parse(
                R"([{"type":"integer"},{"type":["integer","null"],"format":"int32"},)"
                R"({"type":"number"},{"type":"integer","minimum":0,"maximum":4294967295,)"
                R"("format":"int32"},{"type":"integer","format":"int64"}])")),
            Faults({"/0", "/1", "/2", "/3"}));
}

TEST(GeneratedClients, NamesOfComponentsStayApart) {
  EXPECT_EQ(colliding_names(schemas()), Faults());
  EXPECT_EQ(colliding_names(
                Json::parse(R"({"Key":{},"NewKey":{},"job_list":{},"JobList":{},"Objects":{}})")),
            Faults({"NewKey", "JobList", "JobList", "JobList", "Objects"}));
}

TEST(GeneratedClients, NoComponentIsPrintedTwice) {
  EXPECT_EQ(repeated_components(schemas()), Faults());
  EXPECT_EQ(repeated_components(
                Json::parse(R"({"A":{"properties":{},"description":"a"},"B":{"properties":{}}})")),
            Faults({"B"}));
}

TEST(GeneratedClients, ValuesOfNamedEnumerationsStayApart) {
  EXPECT_EQ(colliding_values(schemas()), Faults());
  EXPECT_EQ(colliding_values(Json::parse(R"({"A":{"enum":["none","a"]},"B":{"enum":["none"]}})")),
            Faults({"B"}));
}

TEST(GeneratedClients, ParametersOfSeveralTypesHaveNoDefault) {
  EXPECT_EQ(defaults_of_choices(document()["paths"]), Faults());
  EXPECT_EQ(defaults_of_choices(Json::parse(R"({"schema":{"anyOf":[],"default":0}})")),
            Faults({"/schema"}));
}

TEST(GeneratedClients, NamesOfParametersStayApart) {
  EXPECT_EQ(colliding_parameters(document()["paths"]), Faults());
  EXPECT_EQ(colliding_parameters(
                Json::parse(R"({"/a":{"get":{"parameters":[{"name":"range"},{"name":"Range"}]}},)"
                            R"("/b":{"get":{"parameters":[{"name":"range"},)"
                            R"({"name":"Range","x-go-name":"RangeHeader"}]}}})")),
            Faults({"/~1a/get/parameters/range"}));
}

TEST(SchemaParts, KeepDescriptionAndNullWhereTheyAreUsed) {
  Json parts =
      Json::parse(R"({"A":{"properties":{"box":{"type":["object","null"],"description":"Its box.",)"
                  R"("properties":{"x":{}},"x-default":null}}},)"
                  R"("B":{"properties":{"boxes":{"type":"array","items":{"type":"object",)"
                  R"("description":"Of B.","properties":{"x":{}}}}}}})");
  api::name_parts(parts);
  EXPECT_EQ(
      parts,
      Json::parse(R"({"ABox":{"type":"object","description":"Its box.","properties":{"x":{}}},)"
                  R"("A":{"properties":{"box":{"description":"Its box.","x-default":null,)"
                  R"("anyOf":[{"$ref":"#/components/schemas/ABox"},{"type":"null"}]}}},)"
                  R"("B":{"properties":{"boxes":{"type":"array","items":{"description":"Of B.",)"
                  R"("$ref":"#/components/schemas/ABox"}}}}})"));
}

}  // namespace
