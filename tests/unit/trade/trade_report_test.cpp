#include "client/trade/trade_report.h"

#include <gtest/gtest.h>

#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>

#include "client/trade/trade_choice.h"
#include "tests/support/temporary_folder.h"

namespace umbriel {
namespace {

TradeResult example() {
    TradeResult result;
    result.scene = "a <scene> & \"more\"";
    result.width = 4;
    result.height = 3;
    result.truthFactors = FloatImage(4, 3, {"factor"}, 1.0f);
    result.judged.assign(12, 1);
    for (int i = 0; i < 3; ++i) {
        TradeRow row;
        row.setting = {i == 0 ? "none" : "std", 512u << i, {}, {}, {}};
        row.errors.error.leak = 0.1 / (i + 1);
        row.errors.error.acne = 0.01;
        row.errors.error.judged = 12;
        row.cost.cpuMilliseconds = 10.0 * (i + 1);
        row.cost.wallMilliseconds = 12.0 * (i + 1);
        row.factors = FloatImage(4, 3, {"factor"}, 0.0f);
        result.rows.push_back(std::move(row));
    }
    result.rows[0].errors.edges.distance.median = std::numeric_limits<double>::infinity();
    result.rows[2].setting.filter = 8.0;
    result.rows[2].setting.samples = 6;
    result.rows[2].setting.fields = {{"shadowColor", "0,0,0"}};
    return result;
}

TEST(TradeReport, JsonHasTheRowsOfTheContract) {
    const auto json = nlohmann::json::parse(tradeJson(example()));
    ASSERT_EQ(json["rows"].size(), 3u);
    for (const char* key : {"technique", "map_size", "filter", "samples", "error", "leak", "acne", "edge_median_px",
                            "edge_p95_px", "rmse", "wall_ms", "cpu_ms", "map_bytes"})
        for (const auto& row : json["rows"]) EXPECT_TRUE(row.contains(key)) << key;
    EXPECT_TRUE(json["rows"][0]["edge_median_px"].is_null());
    EXPECT_TRUE(json["rows"][0]["filter"].is_null());
    EXPECT_EQ(json["rows"][2]["filter"], 8.0);
    EXPECT_DOUBLE_EQ(json["rows"][1]["error"].get<double>(), 0.06);
}

TEST(TradeReport, TechniquesWithoutMapsHaveNoMapSize) {
    TradeResult result = example();
    result.rows.resize(1);
    result.rows[0].setting = {"zfail", 512, {}, {}, {}, false};
    const auto json = nlohmann::json::parse(tradeJson(result));
    EXPECT_TRUE(json["rows"][0]["map_size"].is_null());
    const std::string csv = tradeCsv({&result, 1});
    EXPECT_EQ(csv.find("512"), std::string::npos) << csv;
    EXPECT_NE(csv.find("zfail,,"), std::string::npos) << csv;
    const auto html = tradeHtml({&result, 1});
    ASSERT_TRUE(html);
    EXPECT_NE(html->find("zfail"), std::string::npos);
    EXPECT_EQ(html->find("zfail 512"), std::string::npos);
}

TEST(TradeReport, CsvHasAsManyFieldsInEveryLine) {
    std::istringstream lines(tradeCsv(std::vector{example()}));
    std::string line;
    std::vector<std::size_t> fields;
    while (std::getline(lines, line)) {
        std::size_t count = 1;
        bool quoted = false;
        for (const char c : line) {
            if (c == '"') quoted = !quoted;
            if (c == ',' && !quoted) ++count;
        }
        fields.push_back(count);
    }
    ASSERT_EQ(fields.size(), 4u);
    for (const std::size_t count : fields) EXPECT_EQ(count, fields.front());
}

TEST(TradeReport, ThePageIsWholeAndNeedsNothingElse) {
    const auto html = tradeHtml(std::vector{example()});
    ASSERT_TRUE(html);
    EXPECT_NE(html->find("a &lt;scene&gt; &amp; &quot;more&quot;"), std::string::npos);
    EXPECT_EQ(html->find("<scene>"), std::string::npos);
    EXPECT_EQ(html->find("http"), std::string::npos);
    std::size_t pictures = 0;
    for (std::size_t at = 0; (at = html->find("data:image/png;base64,iVBOR", at)) != std::string::npos; ++at)
        ++pictures;
    EXPECT_EQ(pictures, 9u);
    EXPECT_TRUE(html->ends_with("</html>\n"));
    EXPECT_EQ(html->find("nan"), std::string::npos);
}

TEST(TradeReport, WithoutRowsThereIsStillAPage) {
    TradeResult result;
    EXPECT_TRUE(tradeHtml({&result, 1}));
    EXPECT_EQ(tradeCsv({&result, 1}), "");
}

class StoredTradeFile : public testing::Test {
 protected:
    test::TemporaryFolder folder;
};

TEST_F(StoredTradeFile, ComesBackAsItWas) {
    TradeResult measured = example();
    measured.rows[0].setting.hasMap = false;
    const StoredTrade stored = storedTrade(measured, 2);
    ASSERT_EQ(stored.front.size(), 3u);
    const auto path = folder / "x.gltf.umtrade.json";
    ASSERT_TRUE(writeTrade(path, stored));
    const auto read = readTrade(path);
    ASSERT_TRUE(read);
    ASSERT_TRUE(read->has_value());
    EXPECT_EQ((*read)->scene, stored.scene);
    EXPECT_EQ(labelOf((*read)->chosen.setting), labelOf(stored.chosen.setting));
    ASSERT_EQ((*read)->front.size(), 3u);
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_EQ(labelOf((*read)->front[i].setting), labelOf(stored.front[i].setting));
        EXPECT_EQ((*read)->front[i].setting.hasMap, stored.front[i].setting.hasMap);
        EXPECT_EQ((*read)->front[i].wallMilliseconds, stored.front[i].wallMilliseconds);
    }
}

TEST(StoredTradeChoice, ThatCannotBeDrawnIsFollowedByTheCheapestThatIsNoMoreWrongElseByTheMostAccurate) {
    StoredTrade trade;
    trade.chosen = {{"b", 64, {}, {}, {}}, 0.02, 2.0, 2.0};
    trade.front = {{{"a", 64, {}, {}, {}}, 0.05, 1.0, 1.0},
                   trade.chosen,
                   {{"c", 64, {}, {}, {}}, 0.02, 3.0, 3.0},
                   {{"d", 64, {}, {}, {}}, 0.01, 4.0, 4.0}};
    const auto next = [&](const std::string& possible) {
        const auto setting = nextChoice(
            trade, [&](const TradeSetting& one) { return possible.find(one.technique) != std::string::npos; });
        return setting ? setting->technique : std::string("none");
    };
    EXPECT_EQ(next("acd"), "c");
    EXPECT_EQ(next("ad"), "d");
    EXPECT_EQ(next("a"), "a");
    EXPECT_EQ(next(""), "none");
    EXPECT_EQ(next("abcd"), "b");
    trade.front.insert(trade.front.begin(), {{"e", 64, {}, {}, {}}, 0.04, 0.5, 0.5});
    EXPECT_EQ(next("ae"), "e");
    trade.front.clear();
    EXPECT_EQ(next("abcd"), "none");
}

TEST_F(StoredTradeFile, IsNoneWhereThereIsNoneAndAnErrorWhereItIsBroken) {
    const auto none = readTrade(folder / "absent.umtrade.json");
    ASSERT_TRUE(none);
    EXPECT_FALSE(none->has_value());
    for (const char* text :
         {"", "[]", "{", "{}", "{\"umbriel_trade\": 2}", "{\"umbriel_trade\": 1, \"scene\": \"s\", \"chosen\": {}}",
          "{\"umbriel_trade\": 1, \"scene\": 5, \"chosen\": {}, \"front\": []}"}) {
        std::ofstream(folder / "bad.umtrade.json") << text;
        const auto bad = readTrade(folder / "bad.umtrade.json");
        ASSERT_TRUE(bad.has_error()) << text;
        EXPECT_EQ(bad.error().kind, Error::Kind::BadInput);
        EXPECT_NE(bad.error().message.find("bad.umtrade.json"), std::string::npos);
    }
}

TEST_F(StoredTradeFile, NumbersThatWouldWrapAroundAreRefused) {
    const auto isRead = [&](const std::string& chosen, const std::string& first) {
        const auto point = [](const std::string& more) {
            return R"({"technique": "pcf", "error": 0.1, "wall_ms": 1, "cpu_ms": 1, )" + more + "}";
        };
        std::ofstream(folder / "x.umtrade.json") << R"({"umbriel_trade": 1, "scene": "s", "chosen": )" << point(chosen)
                                                 << R"(, "front": [)" << point(first) << "]}";
        return static_cast<bool>(readTrade(folder / "x.umtrade.json"));
    };
    const std::string sound = R"("map_size": 512, "filter": 8, "samples": 6)";
    EXPECT_TRUE(isRead(sound, sound));
    for (const char* wrong :
         {R"("map_size": -5)", R"("map_size": 1000000000)", R"("map_size": 1099511627840)", R"("map_size": 1e300)",
          R"("map_size": 512, "filter": -1)", R"("map_size": 512, "filter": 1e9)", R"("map_size": 512, "samples": 0)",
          R"("map_size": 512, "samples": 4294967300)"}) {
        EXPECT_FALSE(isRead(wrong, sound)) << wrong;
        EXPECT_FALSE(isRead(sound, wrong)) << wrong;
    }
}

TEST(StoredTradePath, IsBesideFilesAndHereForDemos) {
    EXPECT_EQ(tradeFileOf("a/b.gltf"), "a/b.gltf.umtrade.json");
    EXPECT_EQ(tradeFileOf("demo:city?n=5"), "demo-city-n-5.umtrade.json");
}

}  // namespace
}  // namespace umbriel
