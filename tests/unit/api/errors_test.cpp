#include "api/json/errors.h"

#include <set>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "api/json/error_codes.h"
#include "api/json/json.h"
#include "api/json/limits.h"

namespace {

using core::ErrorCode;

TEST(ErrorTable, HasTheDocumentedStatuses) {
  EXPECT_EQ(api::error_status(ErrorCode::kBadSyntax), 400);
  EXPECT_EQ(api::error_status(api::kUnauthorized), 401);
  EXPECT_EQ(api::error_status(ErrorCode::kForbidden), 403);
  EXPECT_EQ(api::error_status(ErrorCode::kNotFound), 404);
  EXPECT_EQ(api::error_status(api::kNotAcceptable), 406);
  EXPECT_EQ(api::error_status(ErrorCode::kConflict), 409);
  EXPECT_EQ(api::error_status(api::kGone), 410);
  EXPECT_EQ(api::error_status(api::kPreconditionFailed), 412);
  EXPECT_EQ(api::error_status(ErrorCode::kTooLarge), 413);
  EXPECT_EQ(api::error_status(ErrorCode::kUnsupportedFormat), 415);
  EXPECT_EQ(api::error_status(api::kRangeNotSatisfiable), 416);
  EXPECT_EQ(api::error_status(api::kMisdirected), 421);
  EXPECT_EQ(api::error_status(ErrorCode::kInvalidArgument), 422);
  EXPECT_EQ(api::error_status(ErrorCode::kMissingFiles), 424);
  EXPECT_EQ(api::error_status(api::kTooManyRequests), 429);
  EXPECT_EQ(api::error_status(ErrorCode::kInternal), 500);
  EXPECT_EQ(api::error_status(ErrorCode::kUnavailable), 503);
  EXPECT_EQ(api::error_status(ErrorCode::kNoSpace), 507);
}

TEST(ErrorTable, HasARowForEachCodeAndUniqueTypes) {
  std::set<std::string_view> slugs;
  for (int code = 0; code <= static_cast<int>(api::kLastErrorCode); ++code) {
    const api::ErrorRow& row = api::error_row(static_cast<ErrorCode>(code));
    EXPECT_TRUE(slugs.insert(row.slug).second) << row.slug;
    EXPECT_FALSE(row.title.empty());
  }
}

TEST(FromError, TurnsAPointerIntoAFieldError) {
  const auto problem =
      api::from_error({ErrorCode::kInvalidArgument, "no such camera", "/camera/name"});
  EXPECT_EQ(problem.status, 422);
  EXPECT_EQ(problem.type, "/docs#problem-invalid-argument");
  ASSERT_EQ(problem.errors.size(), 1U);
  EXPECT_EQ(problem.errors[0].pointer, "/camera/name");
  EXPECT_EQ(problem.errors[0].detail, "no such camera");
}

TEST(FromError, PutsAnotherLocationBeforeTheMessage) {
  const auto problem = api::from_error({ErrorCode::kTooLarge, "too many", "films"});
  EXPECT_EQ(problem.status, 413);
  EXPECT_EQ(problem.detail, "films: too many");
  EXPECT_TRUE(problem.errors.empty());
}

TEST(FromError, ContainsNoFileNameOfTheServer) {
  for (const ErrorCode code : {ErrorCode::kNoSpace, ErrorCode::kInternal}) {
    const auto problem = api::from_error({code, "cannot write", "/var/lib/tessera/films/a.film"});
    EXPECT_EQ(problem.detail, "cannot write");
    EXPECT_TRUE(problem.errors.empty());
  }
}

TEST(ProblemJson, HasTheMembersOfTheRfc) {
  const auto problem =
      api::make_problem(ErrorCode::kInvalidArgument, {{"/film/width", "0 is outside [1, 16384]"}});
  EXPECT_EQ(api::problem_json(problem, "/v1/jobs"),
            R"({"type":"/docs#problem-invalid-argument","title":"Invalid value","status":422,)"
            R"("detail":"/film/width: 0 is outside [1, 16384]","instance":"/v1/jobs",)"
            R"("errors":[{"pointer":"/film/width","detail":"0 is outside [1, 16384]"}]})");
}

TEST(ProblemJson, OmitsEmptyMembers) {
  const api::Json body =
      api::Json::parse(api::problem_json(api::make_problem(ErrorCode::kNotFound, "gone"), ""));
  EXPECT_FALSE(body.contains("instance"));
  EXPECT_FALSE(body.contains("errors"));
}

TEST(ProblemJson, TruncatesLongTexts) {
  const std::string two_bytes = "\u00e4";
  std::string name(1, 'a');
  for (int i = 0; i < 50'000; ++i) {
    name += two_bytes;
  }
  api::Problem problem = api::make_problem(ErrorCode::kInvalidArgument, name);
  problem.errors = {{"/" + name, name}};
  const api::Json body = api::Json::parse(api::problem_json(problem, ""));
  const auto detail = body.at("detail").get<std::string>();
  EXPECT_EQ(detail, name.substr(0, 4095) + "...");
  EXPECT_EQ(body.at("errors").at(0).at("detail"), detail);
  EXPECT_EQ(body.at("errors").at(0).at("pointer").get<std::string>().size(), 4096U + 3);
}

TEST(MakeProblem, CountsFaultsAndShowsTheFirst32) {
  const std::vector<api::FieldError> errors(40, {"/a", "is wrong"});
  const auto problem = api::make_problem(ErrorCode::kInvalidArgument, errors);
  EXPECT_EQ(problem.detail, "/a: is wrong (and 39 more)");
  EXPECT_EQ(problem.errors.size(), 32U);
}

TEST(LimitTable, HasPositiveValuesAndUniqueNames) {
  std::set<std::string_view> names;
  for (const api::LimitRow& row : api::limit_table()) {
    EXPECT_TRUE(names.insert(row.name).second) << row.name;
    EXPECT_GT(row.value, 0) << row.name;
    EXPECT_FALSE(row.summary.empty()) << row.name;
  }
}

}  // namespace
