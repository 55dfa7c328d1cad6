#include "client/import/brdf_import.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <numbers>

#include "common/math/lafortune_fit.h"
#include "tests/unit/import/gltf_maker.h"

namespace umbriel::test {
namespace {

constexpr double kPi = std::numbers::pi;

glm::dvec3 direction(double theta, double phi) {
    return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

LafortuneModel plastic() {
    LafortuneModel model;
    model.diffuse = {0.4, 0.1, 0.05};
    model.lobes.push_back({-1.0, 1.0, 40.0, glm::dvec3(2.0)});
    return model;
}

std::string textOf(const LafortuneModel& model, double step) {
    std::string text = "# theta_in theta_out phi r g b\n";
    for (double in = 0; in < 90; in += step)
        for (double out = 0; out < 90; out += step)
            for (double phi = 0; phi <= 180; phi += step) {
                const glm::dvec3 value =
                    model.value(direction(in / 180 * kPi, 0), direction(out / 180 * kPi, phi / 180 * kPi));
                text += fmt::format("{} {} {}\t{}, {}, {}\r\n", in, out, phi, value.x, value.y, value.z);
            }
    return text;
}

TEST(BrdfImport, TextArrivesInOrderWhateverTheOrderOfItsLines) {
    const auto table = parseBrdfText("40 0 180 9 8 7 # the last of this theta\n\n40 0 0 1 2 3\n0 0 0 4 5 6\n0 0 180 5 5 5\n"
                                     "0 30 0 1 1 1\n0 30 180 2 2 2\n40 30 0 3 3 3\n40 30 180 1e-3 0 0");
    ASSERT_TRUE(table) << table.error().message;
    EXPECT_EQ(table->thetaIn.size(), 2u);
    EXPECT_NEAR(table->thetaIn[1], 40.0 / 180.0 * kPi, 1e-15);
    EXPECT_EQ(table->at(1, 0, 1), glm::dvec3(9, 8, 7));
    EXPECT_EQ(table->at(1, 1, 1), glm::dvec3(1e-3, 0, 0));
    EXPECT_EQ(table->at(0, 0, 0), glm::dvec3(4, 5, 6));
}

TEST(BrdfImport, BrokenTextIsRefusedWithItsPlace) {
    const auto errorOf = [](const char* text) {
        const auto table = parseBrdfText(text);
        return table ? std::string() : table.error().message;
    };
    EXPECT_NE(errorOf("0 0 0 1 1\n").find("line 1: has 5 numbers"), std::string::npos);
    EXPECT_NE(errorOf("\n0 0 zero 1 1 1\n").find("line 2: expected six finite numbers"), std::string::npos);
    EXPECT_NE(errorOf("0 0 0 1 1 nan\n").find("line 1"), std::string::npos);
    EXPECT_NE(errorOf("0 0 0 1 1 1 1\n").find("line 1"), std::string::npos);
    EXPECT_EQ(errorOf("0 0 0 1 1 1\n95 0 0 1 1 1\n"), "line 2: theta_in of 95 degrees; expected 0 to 90 degrees");
    EXPECT_EQ(errorOf("0 -1 0 1 1 1\n"), "line 1: theta_out of -1 degrees; expected 0 to 90 degrees");
    EXPECT_EQ(errorOf("0 0 360 1 1 1\n"), "line 1: phi of 360 degrees; expected 0 to 180 degrees");
    EXPECT_NE(errorOf("").find("0 rows"), std::string::npos);
    EXPECT_NE(errorOf("0 0 0 1 1 1\n0 10 5 1 1 1\n").find("2 rows for a grid of 1 x 2 x 2"), std::string::npos);
    EXPECT_NE(errorOf("0 0 0 1 1 1\n0 0 180 -1 1 1\n0 9 0 1 1 1\n0 9 180 1 1 1\n9 0 0 1 1 1\n9 0 180 1 1 1\n"
                      "9 9 0 1 1 1\n9 9 180 1 1 1\n")
                  .find("BRDF value 2 is -1"),
              std::string::npos);
}

TEST(BrdfImport, AFileOfLobesIsFittedWithItsLobes) {
    const TempFolder folder;
    std::vector<std::string> notes;
    const auto table = loadBrdf(folder.write("plastic.brdf", textOf(plastic(), 7.5)), notes);
    ASSERT_TRUE(table) << table.error().message;
    const auto fit = fitLafortune(*table, 1);
    ASSERT_TRUE(fit);
    EXPECT_LT(fit->residual.x, 0.01);
    EXPECT_NEAR(fit->model.diffuse.x, 0.4, 0.01);
    EXPECT_NEAR(fit->model.lobes[0].exponent, 40.0, 2.0);
    EXPECT_FALSE(loadBrdf(folder.path("absent.brdf"), notes));
}

// A table in the database's own order: the half vector's angle slowest, unevenly; values scaled as its reader does.
TEST(BrdfImport, MerlTablesAreReadByTheirAngles) {
    std::string bytes(12 + 3 * 8 * std::size_t{90} * 90 * 180, '\0');
    const std::int32_t sizes[3] = {90, 90, 180};
    std::memcpy(bytes.data(), sizes, 12);
    const auto put = [&](std::size_t channel, std::size_t index, double value) {
        std::memcpy(bytes.data() + 12 + (channel * 90 * 90 * 180 + index) * 8, &value, 8);
    };
    // Red: 1500 times the half vector's angle in radians; green: 1500 / 1.15 times the light's angle to it; blue: -1.
    for (std::size_t half = 0; half < 90; ++half)
        for (std::size_t diff = 0; diff < 90; ++diff)
            for (std::size_t azimuth = 0; azimuth < 180; ++azimuth) {
                const std::size_t index = (half * 90 + diff) * 180 + azimuth;
                const double root = (double(half) + 0.5) / 90.0;
                put(0, index, 1500.0 * root * root * kPi / 2);
                put(1, index, 1500.0 / 1.15 * (double(diff) + 0.5) / 90.0 * kPi / 2);
                put(2, index, half == 0 && diff == 0 ? -1.0 : 1500.0 / 1.66);
            }
    std::vector<std::string> notes;
    const auto table = parseMerl(bytes, notes);
    ASSERT_TRUE(table) << table.error().message;
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_NE(notes[0].find("19 of 2736 directions were not measured"), std::string::npos)
        << notes[0] << ": straight on, at every azimuth";
    EXPECT_EQ(table->at(0, 0, 0), glm::dvec3(0.0)) << "straight on, where it is missing";
    for (const auto& [i, j, k] : {std::array{3, 9, 0}, {5, 5, 18}, {11, 4, 10}, {11, 11, 18}}) {
        const glm::dvec3 in = direction(table->thetaIn[std::size_t(i)], 0);
        const glm::dvec3 out = direction(table->thetaOut[std::size_t(j)], table->phi[std::size_t(k)]);
        const glm::dvec3 h = glm::normalize(in + out);
        const glm::dvec3 value = table->at(std::size_t(i), std::size_t(j), std::size_t(k));
        EXPECT_NEAR(value.x, std::acos(std::min(1.0, h.z)), 0.03);
        EXPECT_NEAR(value.y, std::acos(std::min(1.0, glm::dot(in, h))), 0.01);
        EXPECT_NEAR(value.z, 1.0, 1e-12);
    }
    bytes.pop_back();
    EXPECT_NE(parseMerl(bytes, notes).error().message.find("a MERL table has 34992012"), std::string::npos);
    EXPECT_NE(parseMerl("text", notes).error().message.find("90 90 180"), std::string::npos);
}

}  // namespace
}  // namespace umbriel::test
