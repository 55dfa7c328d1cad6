#include "client/trade/trade_row.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "client/trade/trade_choice.h"

namespace umbriel {
namespace {

TradeRow row(double cost, double error, double wall = -1.0) {
    TradeRow made;
    made.setting.technique = "std";
    made.cost.cpuMilliseconds = cost;
    made.cost.wallMilliseconds = wall < 0.0 ? cost : wall;
    made.errors.error.leak = error;
    return made;
}

TEST(Pareto, KeepsWhatNothingBeats) {
    const std::vector<TradeRow> rows = {row(10, 0.05), row(20, 0.01), row(15, 0.06),
                                        row(30, 0.01), row(5, 0.2),   row(20, 0.02)};
    EXPECT_EQ(paretoFront(rows), (std::vector<std::size_t>{4, 0, 1}));
    EXPECT_TRUE(paretoFront({}).empty());
}

RC_GTEST_PROP(Pareto, EveryRowIsOnTheFrontOrBeatenByARowOnIt, ()) {
    const auto numbers = *rc::gen::container<std::vector<std::pair<int, int>>>(
        rc::gen::pair(rc::gen::inRange(0, 12), rc::gen::inRange(0, 12)));
    std::vector<TradeRow> rows;
    for (const auto& [cost, error] : numbers) rows.push_back(row(cost, error));
    const auto front = paretoFront(rows);
    RC_ASSERT(rows.empty() == front.empty());
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const bool beaten = std::any_of(front.begin(), front.end(), [&](std::size_t f) {
            return rows[f].cost.cpuMilliseconds <= rows[i].cost.cpuMilliseconds &&
                   rows[f].errors.error.error() <= rows[i].errors.error.error();
        });
        RC_ASSERT(beaten);  // by itself when it is on the front
    }
    for (std::size_t k = 1; k < front.size(); ++k) {
        RC_ASSERT(rows[front[k - 1]].cost.cpuMilliseconds < rows[front[k]].cost.cpuMilliseconds);
        RC_ASSERT(rows[front[k - 1]].errors.error.error() > rows[front[k]].errors.error.error());
    }
}

TEST(Choice, IsTheCheapestWithinTheErrorOrTheBestWithinTheBudget) {
    const std::vector<TradeRow> rows = {row(10, 0.05, 12), row(20, 0.01, 25), row(40, 0.002, 50)};
    EXPECT_EQ(choose(rows, 0.02, std::nullopt), 1u);
    EXPECT_EQ(choose(rows, 0.001, std::nullopt), std::nullopt);
    EXPECT_EQ(choose(rows, std::nullopt, 30.0), 1u);
    EXPECT_EQ(choose(rows, std::nullopt, 1.0), std::nullopt);
    EXPECT_EQ(choose(rows, 0.06, 30.0), 0u);
    EXPECT_EQ(choose(rows, 0.005, 30.0), std::nullopt);
    EXPECT_EQ(choose(rows, std::nullopt, std::nullopt), 2u);
    EXPECT_EQ(choose({}, 1.0, std::nullopt), std::nullopt);
}

// A mode that is right on its plane and nowhere else is not the best of a scene.
TEST(Choice, AndTheFrontCompareRowsOverTheSamePixels) {
    std::vector<TradeRow> rows = {row(10, 0.05), row(5, 0.0), row(40, 0.002)};
    EXPECT_EQ(paretoFront(rows), (std::vector<std::size_t>{1}));
    rows[1].errors.errorEverywhere = 0.08;
    EXPECT_EQ(paretoFront(rows), (std::vector<std::size_t>{1, 0, 2}));
    EXPECT_EQ(choose(rows, 0.06, std::nullopt), 0u);
    EXPECT_EQ(choose(rows, 0.01, std::nullopt), 2u);
    EXPECT_EQ(choose(rows, std::nullopt, 20.0), 0u);
    TradeResult result;
    result.rows = rows;
    const StoredTrade stored = storedTrade(result, 0);
    ASSERT_EQ(stored.front.size(), 3u);
    EXPECT_EQ(stored.front[0].error, 0.08);
}

TEST(Choice, LabelsNameEverythingThatIsSet) {
    EXPECT_EQ(labelOf({"std:scene", 1024, {}, {}, {}}), "std:scene 1024");
    EXPECT_EQ(labelOf({"zfail", 512, {}, {}, {}, false}), "zfail");
    EXPECT_EQ(labelOf({"pcf", 512, 8.0, 6, {{"gauss", "4"}}}), "pcf 512 w8 n6 gauss=4");
}

}  // namespace
}  // namespace umbriel
