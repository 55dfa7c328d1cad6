#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>

#include "client/import/photometric_eulumdat.h"
#include "client/import/photometric_ies.h"
#include "tests/support/temporary_folder.h"

namespace umbriel {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

double intensityAt(const PhotometricImport& import, double gamma, double c) {
    return import.web.intensity(gamma * kDegree, c * kDegree);
}

// Three vertical angles and the given planes; value = 100 * plane + angle, from 1.
std::string ies(const std::string& horizontal, int planes, const std::string& tilt = "TILT=NONE",
                const std::string& firstLine = "IESNA:LM-63-2002", const std::string& factors = "0.9 0.5 20") {
    std::string text = firstLine + "\r\n[TEST] ours\r\n[LUMINAIRE] Lamp \x1b[1m\r\n" + tilt + "\r\n1 1000 2 3 " +
                       std::to_string(planes) + " 1 2 0 0 0\r\n" + factors + "\r\n0 45, 90\r\n" + horizontal + "\r\n";
    for (int i = 1; i <= planes; ++i) {
        for (int j = 1; j <= 3; ++j) {
            text += std::to_string(100 * i + j) + " ";
        }
        text += "\r\n";
    }
    return text;
}

PhotometricImport parsed(const Result<PhotometricImport>& import) {
    EXPECT_TRUE(import.has_value()) << (import ? "" : import.error().message);
    return import ? *import : PhotometricImport{};
}

void expectRefusal(const Result<PhotometricImport>& import, const std::string& words) {
    ASSERT_FALSE(import.has_value()) << words;
    EXPECT_EQ(import.error().kind, Error::Kind::BadInput);
    EXPECT_NE(import.error().message.find(words), std::string::npos) << import.error().message;
}

TEST(PhotometricIes, CandelaAreValuesTimesTheFactorsOfTheEdition) {
    const PhotometricImport import = parsed(parseIes(ies("0", 1)));
    EXPECT_NEAR(intensityAt(import, 0, 77), 101 * 2 * 0.9, 1e-3);
    EXPECT_NEAR(intensityAt(import, 45, 0), 102 * 2 * 0.9, 1e-3);
    EXPECT_NEAR(intensityAt(import, 67.5, 200), 102.5 * 2 * 0.9, 1e-3);
    EXPECT_EQ(intensityAt(import, 91, 0), 0.0);
    EXPECT_EQ(import.lampLumens, 1000.0);
    EXPECT_EQ(import.name, "Lamp ?[1m");
    EXPECT_TRUE(import.repairs.empty());
    // Until 1991 the second factor counts; 1986 has no first line of its own.
    for (const char* first : {"IESNA91", "A luminaire of 1986"}) {
        EXPECT_NEAR(intensityAt(parsed(parseIes(ies("0", 1, "TILT=NONE", first))), 0, 0), 101 * 2 * 0.45, 1e-3);
    }
    EXPECT_NEAR(intensityAt(parsed(parseIes(ies("0", 1, "TILT=NONE", "IESNA:LM-63-1995"))), 0, 0), 101 * 2 * 0.9, 1e-3);
}

// Where each plane shows up, by the hundreds of its values.
TEST(PhotometricIes, SymmetriesAreSpreadOverTheCircle) {
    const auto planeAt = [](const PhotometricImport& import, double c) {
        return std::floor(intensityAt(import, 0, c) / (2 * 0.9) / 100.0 + 1e-4);
    };
    const PhotometricImport quadrant = parsed(parseIes(ies("0 30 90", 3)));
    for (const auto& [c, plane] :
         {std::pair(0, 1), {30, 2}, {90, 3}, {150, 2}, {180, 1}, {210, 2}, {270, 3}, {330, 2}}) {
        EXPECT_EQ(planeAt(quadrant, c), plane) << c;
    }
    const PhotometricImport bilateral = parsed(parseIes(ies("0 60 180", 3)));
    for (const auto& [c, plane] : {std::pair(0, 1), {60, 2}, {180, 3}, {300, 2}, {360, 1}}) {
        EXPECT_EQ(planeAt(bilateral, c), plane) << c;
    }
    const PhotometricImport turned = parsed(parseIes(ies("90 180 270", 3)));
    for (const auto& [c, plane] : {std::pair(90, 1), {180, 2}, {270, 3}, {0, 2}, {360, 2}}) {
        EXPECT_EQ(planeAt(turned, c), plane) << c;
    }
    const PhotometricImport full = parsed(parseIes(ies("0 100 200 360", 4)));
    for (const auto& [c, plane] : {std::pair(0, 1), {100, 2}, {200, 3}, {359, 1}}) {
        EXPECT_EQ(planeAt(full, c), plane) << c;
    }
    const PhotometricImport open = parsed(parseIes(ies("0 120 300", 3)));
    EXPECT_EQ(planeAt(open, 300), 3);
    EXPECT_NEAR(intensityAt(open, 0, 330), 2 * 0.9 * 201, 1e-3);  // half way between 301 and 101
    ASSERT_EQ(open.repairs.size(), 1U);
    EXPECT_NE(open.repairs[0].find("300"), std::string::npos);
}

TEST(PhotometricIes, TiltIsAppliedOrRefused) {
    const PhotometricImport import = parsed(parseIes(ies("0", 1, "TILT=INCLUDE\n1\n3\n0 90 180\n0.8 0.9 1")));
    EXPECT_NEAR(intensityAt(import, 0, 0), 101 * 2 * 0.9 * 0.8, 1e-3);
    ASSERT_EQ(import.repairs.size(), 1U);
    EXPECT_NE(import.repairs[0].find("0.8"), std::string::npos);
    expectRefusal(parseIes(ies("0", 1, "TILT=lamp.tlt")), "names a file");
    expectRefusal(parseIes(ies("0", 1, "TILT=INCLUDE 1 2 10 20 1 1")), "TILT=");
    expectRefusal(parseIes(ies("0", 1, "TILT=INCLUDE\n1\n2\n10 20\n1 1")), "0 degrees");
    expectRefusal(parseIes(ies("0", 1, "TILT=INCLUDE\n1\n99999999\n")), "tilt angles");
}

TEST(PhotometricIes, RepairsSayWhat) {
    std::string text = ies("0", 1, "TILT=NONE", "IESNA91", "0 1 20");
    text.replace(text.find("102"), 3, "-10");
    text += "\nthank you";
    const PhotometricImport import = parsed(parseIes(text));
    EXPECT_EQ(import.repairs.size(), 3U);
    EXPECT_EQ(intensityAt(import, 45, 0), 0.0);
    EXPECT_NEAR(intensityAt(import, 0, 0), 202.0, 1e-3);
}

TEST(PhotometricIes, UnsoundFilesAreRefusedInWords) {
    const std::string sound = ies("0 90", 2);
    const auto with = [&sound](const std::string& what, const std::string& instead) {
        std::string text = sound;
        text.replace(text.find(what), what.size(), instead);
        return text;
    };
    expectRefusal(parseIes(""), "TILT=");
    expectRefusal(parseIes(with("0 45, 90", "0 45, 45")), "vertical angle 3 (45) does not rise");
    expectRefusal(parseIes(with("0 45, 90", "0 45, 190")), "leave 0 to 180");
    expectRefusal(parseIes(with("0 45, 90", "-1 45, 90")), "leave 0 to 180");
    expectRefusal(parseIes(with("\n0 90\r", "\n0 95\r")), "0 to 95");
    expectRefusal(parseIes(with("\n0 90\r", "\n90 0\r")), "horizontal angle 2 (0) does not rise");
    expectRefusal(parseIes(with("3 2 1 2", "3 2 2 2")), "type B");
    expectRefusal(parseIes(with("3 2 1 2", "3 2 3 2")), "type A");
    expectRefusal(parseIes(with("3 2 1 2", "0 2 1 2")), "vertical angles make no sense");
    expectRefusal(parseIes(with("3 2 1 2", "3 1.5 1 2")), "horizontal angles make no sense");
    expectRefusal(parseIes(with("3 2 1 2", "3 1e9 1 2")), "limit");
    expectRefusal(parseIes(with("3 2 1 2", "9999 9999 1 2")), "limit");
    expectRefusal(parseIes(with("3 2 1 2", "9999 3 1 2")), "file ends");
    expectRefusal(parseIes(with("1000 2 3", "1000 0 3")), "multiplier");
    expectRefusal(parseIes(with("1000 2 3", "1000 1e39 3")), "more than a number");
    expectRefusal(parseIes(with("102", "1o2")), "'1o2' is no number");
    for (const char* word : {"nan", "inf", "1e999", "0x10", "--1", "1-"}) {
        expectRefusal(parseIes(with("102", word)), "is no number");
    }
    // Cut off anywhere before the last value.
    for (std::size_t size = 0; size < sound.find("203"); ++size) {
        EXPECT_FALSE(parseIes(sound.substr(0, size)).has_value()) << size;
    }
}

// `planes` C planes in the list, `given` of them with values; three angles. Value = 100 * plane + angle, from 1.
std::string eulumdat(int symmetry, int planes, int given, const std::string& flux = "2000") {
    std::string text = "Maker\r\n1\r\n" + std::to_string(symmetry) + "\r\n" + std::to_string(planes) +
                       "\r\n0\r\n3\r\n45\r\n" + "report\r\nLamp\r\nnumber\r\nfile.ldt\r\n2026\r\n";
    for (int i = 0; i < 9; ++i) {
        text += "0\r\n";  // sizes
    }
    text += "100\r\n80\r\n1.5\r\n0\r\n1\r\n1\r\nLED\r\n" + flux + "\r\n4000 K\r\n80\r\n20\r\n";
    for (int i = 0; i < 10; ++i) {
        text += "0.5\r\n";
    }
    for (int i = 0; i < planes; ++i) {
        text += std::to_string(i * 360.0 / planes) + "\r\n";
    }
    text += "0\r\n45\r\n90\r\n";
    for (int i = 1; i <= given; ++i) {
        for (int j = 1; j <= 3; ++j) {
            text += std::to_string(100 * i + j) + "\r\n";
        }
    }
    return text;
}

TEST(PhotometricEulumdat, SymmetriesAreSpreadOverTheCircle) {
    const double factor = 1.5 * 2.0;
    const auto planeAt = [&](const PhotometricImport& import, double c) {
        return std::floor(intensityAt(import, 0, c) / factor / 100.0 + 1e-4);
    };
    const PhotometricImport none = parsed(parseEulumdat(eulumdat(0, 8, 8)));
    EXPECT_NEAR(intensityAt(none, 45, 90), 302 * factor, 1e-2);
    EXPECT_EQ(none.lampLumens, 2000.0);
    EXPECT_EQ(none.name, "Lamp");
    EXPECT_TRUE(none.repairs.empty());
    EXPECT_EQ(planeAt(none, 315), 8);
    EXPECT_NEAR(intensityAt(none, 0, 337.5), (801 + 101) / 2.0 * factor, 1e-2);
    const PhotometricImport rotational = parsed(parseEulumdat(eulumdat(1, 8, 1)));
    EXPECT_EQ(planeAt(rotational, 123), 1);
    const PhotometricImport across0 = parsed(parseEulumdat(eulumdat(2, 8, 5)));
    for (const auto& [c, plane] : {std::pair(0, 1), {45, 2}, {180, 5}, {225, 4}, {315, 2}}) {
        EXPECT_EQ(planeAt(across0, c), plane) << c;
    }
    const PhotometricImport across90 = parsed(parseEulumdat(eulumdat(3, 8, 5)));
    for (const auto& [c, plane] :
         {std::pair(270, 1), {315, 2}, {0, 3}, {45, 4}, {90, 5}, {135, 4}, {180, 3}, {225, 2}}) {
        EXPECT_EQ(planeAt(across90, c), plane) << c;
    }
    const PhotometricImport quadrant = parsed(parseEulumdat(eulumdat(4, 8, 3)));
    for (const auto& [c, plane] : {std::pair(0, 1), {45, 2}, {90, 3}, {135, 2}, {180, 1}, {270, 3}, {315, 2}}) {
        EXPECT_EQ(planeAt(quadrant, c), plane) << c;
    }
}

TEST(PhotometricEulumdat, UnsoundFilesAreRefusedOrRepairedInWords) {
    const std::string sound = eulumdat(2, 8, 5);
    const auto with = [&sound](const std::string& what, const std::string& instead) {
        std::string text = sound;
        text.replace(text.find(what), what.size(), instead);
        return text;
    };
    expectRefusal(parseEulumdat(eulumdat(2, 7, 5)), "7 planes do not fit symmetry 2");
    expectRefusal(parseEulumdat(eulumdat(4, 6, 3)), "multiple of 4");
    expectRefusal(parseEulumdat(eulumdat(5, 8, 5)), "symmetry 5");
    expectRefusal(parseEulumdat(eulumdat(2, 8, 5, "0")), "luminous flux");
    expectRefusal(parseEulumdat(eulumdat(2, 8, 5, "-1")), "luminous flux");
    expectRefusal(parseEulumdat(with("\r\n8\r\n", "\r\n80000000\r\n")), "limit");
    expectRefusal(parseEulumdat(with("\r\n8\r\n", "\r\neight\r\n")), "line 4 is 'eight'");
    expectRefusal(parseEulumdat(with("\r\n0\r\n45\r\n90\r\n1", "\r\n0\r\n45\r\n30\r\n1")), "does not rise");
    expectRefusal(parseEulumdat(with("135.000000", "90.0")), "C angle 4 (90) does not rise");
    expectRefusal(parseEulumdat(with("\r\n202\r\n", "\r\nnan\r\n")), "no number");
    for (std::size_t size = 0; size < sound.find("503"); ++size) {
        EXPECT_FALSE(parseEulumdat(sound.substr(0, size)).has_value()) << size;
    }
    const PhotometricImport commas = parsed(parseEulumdat(with("\r\n1.5\r\n", "\r\n1,5\r\n")));
    EXPECT_EQ(commas.repairs.size(), 1U);
    EXPECT_NEAR(intensityAt(commas, 0, 0), 303.0, 1e-2);
    EXPECT_EQ(parsed(parseEulumdat(with("\r\n202\r\n", "\r\n-202\r\n"))).repairs.size(), 1U);
    const PhotometricImport sets = parsed(
        parseEulumdat(with("\r\n0\r\n1\r\n1\r\nLED", "\r\n0\r\n2\r\n1\r\nLED\r\n2000\r\nK\r\n80\r\n5\r\n1\r\nother")));
    EXPECT_EQ(sets.repairs.size(), 1U);
    EXPECT_NEAR(intensityAt(sets, 0, 0), 303.0, 1e-2);
}

// Damage of any kind ends with an answer, and what is accepted is a sound web.
TEST(PhotometricFiles, MutationsEndWithAnAnswer) {
    std::mt19937_64 random(5);
    const std::string files[] = {ies("0 30 90", 3), ies("0", 1, "TILT=INCLUDE\n1\n2\n0 90\n1 1"), eulumdat(3, 8, 5)};
    int accepted = 0;
    for (int i = 0; i < 6000; ++i) {
        std::string text = files[i % 3];
        for (int hits = 1 + static_cast<int>(random() % 4); hits > 0; --hits) {
            static constexpr char kBytes[] = "0123456789.-+eE ,\n\r\tT=\0\xff";
            text[random() % text.size()] = kBytes[random() % sizeof kBytes];
        }
        const Result<PhotometricImport> import = i % 3 == 2 ? parseEulumdat(text) : parseIes(text);
        if (!import) {
            EXPECT_FALSE(import.error().message.empty());
            continue;
        }
        ++accepted;
        const PhotometricWeb& web = import->web;
        ASSERT_EQ(web.candela.size(), web.vertical.size() * web.horizontal.size());
        ASSERT_LE(web.horizontal.front(), 0.0);
        ASSERT_GE(web.horizontal.back(), 2.0 * std::numbers::pi);
        ASSERT_TRUE(std::isfinite(web.luminousFlux()));
        ASSERT_GE(web.intensity(0.7, 4.0), 0.0);
    }
    EXPECT_GT(accepted, 100);
}

TEST(PhotometricFiles, MessagesNameTheFile) {
    const test::TemporaryFolder folder;
    const auto write = [&folder](const char* name, const std::string& text) { return folder.write(name, text); };
    EXPECT_TRUE(readPhotometricFile(write("a.IES", ies("0", 1))).has_value());
    EXPECT_TRUE(readPhotometricFile(write("a.ldt", eulumdat(0, 8, 8))).has_value());
    EXPECT_TRUE(readPhotometricFile(write("a.txt", ies("0", 1))).has_value());
    EXPECT_TRUE(readPhotometricFile(write("b.txt", eulumdat(0, 8, 8))).has_value());
    expectRefusal(readPhotometricFile(write("empty.ies", "")), "empty.ies");
    expectRefusal(readPhotometricFile(folder / "none.ies"), "none.ies': no such file");
    expectRefusal(readPhotometricFile(folder.path()), "not a regular file");
    PhotometricLimits limits;
    limits.fileBytes = 10;
    expectRefusal(readPhotometricFile(folder / "a.ldt", limits), "larger than 10 bytes");
}

// The integral of the web against the flux the files state: makers' own figures, so within a few percent of the output
// ratio they state or of the lamp.
TEST(PhotometricFiles, SharedFilesLoadAndEmitWhatTheySay) {
    const char* shared = std::getenv("UMBRIEL_SHARED");
    if (shared == nullptr) {
        GTEST_SKIP() << "UMBRIEL_SHARED is not set";
    }
    const std::filesystem::path folder = std::filesystem::path(shared) / "data/photometric";
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
        const PhotometricImport import = parsed(readPhotometricFile(entry.path()));
        const double share = import.web.luminousFlux() / import.lampLumens;
        EXPECT_GT(share, 0.2) << entry.path();
        EXPECT_LT(share, 1.02) << entry.path();
    }
}

}  // namespace
}  // namespace umbriel
