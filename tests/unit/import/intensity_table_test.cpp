#include "client/import/intensity_table.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/scene/core_types.h"

namespace umbriel {
namespace {

class IntensityTableTest : public ::testing::Test {
 protected:
    IntensityTableTest() {
        registerCoreTypes(types);
        scene = std::make_unique<Aspect>(types, ids);
    }
    const IntensityTable& tableOf(const PhotometricImport& luminaire) {
        return scene->get(createIntensityTable(*scene, luminaire));
    }
    // Every `step` degrees over the sphere; f(gamma, C) candela, both in degrees.
    static PhotometricImport sampled(double step, float (*f)(double gamma, double c)) {
        PhotometricImport made;
        for (double gamma = 0; gamma <= 180.0; gamma += step)
            made.web.vertical.push_back(gamma * std::numbers::pi / 180);
        for (double c = 0; c <= 360.0; c += step) {
            made.web.horizontal.push_back(c * std::numbers::pi / 180);
            for (double gamma = 0; gamma <= 180.0; gamma += step)
                made.web.candela.push_back(f(gamma, c == 360.0 ? 0.0 : c));
        }
        return made;
    }

    TypeRegistry types;
    IdSource ids;
    std::unique_ptr<Aspect> scene;
};

TEST_F(IntensityTableTest, ARegularFileIsTakenEntryByEntry) {
    const PhotometricImport luminaire = sampled(15, [](double gamma, double c) { return float(200 - gamma + c / 2); });
    const IntensityTable& table = tableOf(luminaire);
    ASSERT_EQ(table.columns, 24u);
    ASSERT_EQ(table.rows, 13u);
    const double brightest = luminaire.web.maxIntensity();
    for (std::size_t row = 0; row < 13; ++row)
        for (std::size_t column = 0; column < 24; ++column)
            EXPECT_NEAR(table.shares[row * 24 + column], luminaire.web.at(column, row) / brightest, 1e-6);
}

TEST_F(IntensityTableTest, ALuminaireThatIsTheSameAllAroundHasOneColumn) {
    const IntensityTable& table = tableOf(sampled(30, [](double gamma, double) { return float(gamma); }));
    EXPECT_EQ(table.columns, 1u);
    EXPECT_EQ(table.shares.size(), table.rows.get());
    EXPECT_EQ(table.shares[table.rows - 1], 1.0f);
}

TEST_F(IntensityTableTest, ADarkLuminaireIsDark) {
    const IntensityTable& table = tableOf(sampled(45, [](double, double) { return 0.0f; }));
    for (std::size_t i = 0; i < table.shares.size(); ++i) EXPECT_EQ(table.shares[i], 0.0f);
}

TEST_F(IntensityTableTest, StepsHaveALimit) {
    PhotometricImport fine = sampled(90, [](double gamma, double c) { return float(gamma + c); });
    fine.web.vertical[1] = 1e-9;
    fine.web.horizontal[1] = 1e-9;
    const IntensityTable& table = tableOf(fine);
    EXPECT_LE(table.columns, IntensityTable::kMaxSide);
    EXPECT_LE(table.rows, IntensityTable::kMaxSide);
}

}  // namespace
}  // namespace umbriel
