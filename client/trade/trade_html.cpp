#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "client/trade/trade_report.h"
#include "common/image/display.h"
#include "common/image/png_io.h"

namespace umbriel {
namespace {

constexpr int kThumbnailWidth = 320;

std::string escaped(std::string_view text) {
    std::string out;
    for (const char c : text) {
        if (c == '&')
            out += "&amp;";
        else if (c == '<')
            out += "&lt;";
        else if (c == '>')
            out += "&gt;";
        else if (c == '"')
            out += "&quot;";
        else
            out += c;
    }
    return out;
}

std::string base64(std::span<const std::uint8_t> bytes) {
    constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        const std::uint32_t chunk = std::uint32_t{bytes[i]} << 16 |
                                    (i + 1 < bytes.size() ? std::uint32_t{bytes[i + 1]} << 8 : 0u) |
                                    (i + 2 < bytes.size() ? bytes[i + 2] : 0u);
        text += kDigits[chunk >> 18];
        text += kDigits[chunk >> 12 & 63];
        text += i + 1 < bytes.size() ? kDigits[chunk >> 6 & 63] : '=';
        text += i + 2 < bytes.size() ? kDigits[chunk & 63] : '=';
    }
    return text;
}

struct Rgb {
    double r = 0.0, g = 0.0, b = 0.0;
};

// Scaled down by whole numbers. pixel(x, y): linear colour. largest: the strongest difference of a block is shown, so
// that single pixels are seen; else the mean.
template <class Pixel>
Result<std::string> picture(int width, int height, const Pixel& pixel, bool largest) {
    const int step = std::max(1, (width + kThumbnailWidth - 1) / kThumbnailWidth);
    const int columns = std::max(1, width / step), rows = std::max(1, height / step);
    std::vector<std::uint8_t> samples;
    for (int row = 0; row < rows; ++row)
        for (int column = 0; column < columns; ++column) {
            Rgb sum, strongest;
            double most = -1.0;
            int count = 0;
            for (int y = row * step; y < std::min(height, (row + 1) * step); ++y)
                for (int x = column * step; x < std::min(width, (column + 1) * step); ++x) {
                    const Rgb c = pixel(x, y);
                    sum = {sum.r + c.r, sum.g + c.g, sum.b + c.b};
                    ++count;
                    const double strength = std::abs(c.r - c.b);
                    if (strength > most) {
                        most = strength;
                        strongest = c;
                    }
                }
            const double scale = count > 0 ? 1.0 / count : 0.0;
            const Rgb shown = largest ? strongest : Rgb{sum.r * scale, sum.g * scale, sum.b * scale};
            for (const double channel : {shown.r, shown.g, shown.b})
                samples.push_back(displayByte(static_cast<float>(channel), 1.0));
        }
    auto png = encodePng(columns, rows, 3, samples);
    if (!png) return png.error();
    return fmt::format("<img width=\"{}\" height=\"{}\" alt=\"\" src=\"data:image/png;base64,{}\">", columns, rows,
                       base64(*png));
}

// The techniques' colours, told apart also by those who see red and green alike (Okabe and Ito 2008).
constexpr std::array<std::string_view, 8> kColours = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                                      "#e69f00", "#56b4e9", "#000000", "#8a8a00"};

// A point of the diagram; kinds beyond the colours are told apart by shape, discs before squares before diamonds.
std::string mark(std::size_t kind, double x, double y, double radius, std::string_view outline,
                 const std::string& title) {
    const std::size_t shape = kind / kColours.size();
    const double half = shape == 0 ? radius : 0.89 * radius;
    return fmt::format(
        "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" rx=\"{:.1f}\" fill=\"{}\" stroke=\"{}\" "
        "stroke-width=\"2\"{}><title>{}</title></rect>\n",
        x - half, y - half, 2 * half, 2 * half, shape == 0 ? radius : 0.0, kColours[kind % kColours.size()], outline,
        shape == 2 ? fmt::format(" transform=\"rotate(45 {:.1f} {:.1f})\"", x, y) : std::string(), title);
}

std::string tick(double value) {
    return fmt::format("{:g}", value);
}

// Powers of ten times 1, 2, 5 within a range.
std::vector<double> ticks(double low, double high) {
    std::vector<double> values;
    for (double decade = std::pow(10.0, std::floor(std::log10(low))); decade <= high; decade *= 10.0)
        for (const double digit : {1.0, 2.0, 5.0})
            if (digit * decade >= low && digit * decade <= high) values.push_back(digit * decade);
    return values;
}

std::string frontSvg(const TradeResult& result) {
    constexpr double kWidth = 860, kHeight = 460, kLeft = 70, kRight = 170, kTop = 16, kBottom = 50;
    constexpr double kLeastError = 1e-5;  // of the judged pixels; below, points stand on the axis
    double lowX = 1e300, highX = 0, lowY = 1e300, highY = 0;
    for (const TradeRow& row : result.rows) {
        lowX = std::min(lowX, row.cost.cpuMilliseconds);
        highX = std::max(highX, row.cost.cpuMilliseconds);
        const double error = std::max(kLeastError, comparedError(row));
        lowY = std::min(lowY, error);
        highY = std::max(highY, error);
    }
    lowX = std::max(lowX, 1e-3) * 0.85;
    highX = std::max(highX, 2e-3) * 1.18;
    lowY *= 0.7;
    highY *= 1.4;
    const auto x = [&](double ms) {
        return kLeft + (kWidth - kLeft - kRight) * std::log(std::max(ms, lowX) / lowX) / std::log(highX / lowX);
    };
    const auto y = [&](double error) {
        return kHeight - kBottom -
               (kHeight - kTop - kBottom) * std::log(std::max(error, lowY) / lowY) / std::log(highY / lowY);
    };
    std::string svg = fmt::format(
        "<svg viewBox=\"0 0 {} {}\" width=\"{}\" height=\"{}\" font-family=\"sans-serif\" font-size=\"12\">\n", kWidth,
        kHeight, kWidth, kHeight);
    for (const double value : ticks(lowX, highX))
        svg += fmt::format(
            "<line x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1}\" y2=\"{2}\" stroke=\"#ddd\"/><text x=\"{0:.1f}\" y=\"{3}\" "
            "text-anchor=\"middle\">{4}</text>\n",
            x(value), kTop, kHeight - kBottom, kHeight - kBottom + 16, tick(value));
    for (const double percent : ticks(100 * lowY, 100 * highY))
        svg += fmt::format(
            "<line y1=\"{0:.1f}\" y2=\"{0:.1f}\" x1=\"{1}\" x2=\"{2}\" stroke=\"#ddd\"/><text x=\"{3}\" y=\"{0:.1f}\" "
            "text-anchor=\"end\" dy=\"4\">{4}</text>\n",
            y(percent / 100), kLeft, kWidth - kRight, kLeft - 6, tick(percent));
    svg += fmt::format(
        "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">processor time of a frame, all threads, ms</text>\n",
        (kLeft + kWidth - kRight) / 2, kHeight - 12);
    svg += fmt::format(
        "<text transform=\"translate(16 {}) rotate(-90)\" text-anchor=\"middle\">error, % of the judged "
        "pixels</text>\n",
        (kTop + kHeight - kBottom) / 2);
    std::string line;
    for (const std::size_t i : paretoFront(result.rows))
        line += fmt::format("{:.1f},{:.1f} ", x(result.rows[i].cost.cpuMilliseconds),
                            y(std::max(kLeastError, comparedError(result.rows[i]))));
    svg += fmt::format(
        "<polyline points=\"{}\" fill=\"none\" stroke=\"#444\" stroke-width=\"1.5\" stroke-dasharray=\"5 3\"/>\n",
        line);
    std::map<std::string, std::size_t> marks;  // by technique
    double legend = kTop + 12;
    std::vector<std::array<double, 3>> labels;  // left end, right end, base line
    for (const TradeRow& row : result.rows) {
        const auto [known, isNew] = marks.try_emplace(row.setting.technique, marks.size());
        if (isNew) {
            svg += mark(known->second, kWidth - kRight + 20, legend, 5.0, "none", {}) +
                   fmt::format("<text x=\"{}\" y=\"{}\" dy=\"4\">{}</text>\n", kWidth - kRight + 32, legend,
                               escaped(row.setting.technique));
            legend += 20;
        }
        const double px = x(row.cost.cpuMilliseconds), py = y(std::max(kLeastError, comparedError(row)));
        const std::string label = escaped(labelOf(row.setting));
        svg += mark(known->second, px, py, row.chosen ? 8.0 : 5.0, row.onFront ? "#222" : "none",
                    fmt::format("{}: {:.3f} %, {:.1f} ms", label, 100 * comparedError(row), row.cost.cpuMilliseconds));
        if (!row.onFront && !row.chosen) continue;
        // Above its point, else below, else in its title alone: no label lies on another.
        const double left = px + 9, right = left + 7.0 * static_cast<double>(label.size());
        for (const double base : {py - 6, py + 16}) {
            if (std::any_of(labels.begin(), labels.end(), [&](const auto& other) {
                    return left < other[1] && other[0] < right && std::abs(base - other[2]) < 13;
                }))
                continue;
            labels.push_back({left, right, base});
            svg += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n", left, base, label);
            break;
        }
    }
    return svg + "</svg>\n";
}

std::string expectationTable(std::span<const Expectation> expected) {
    if (expected.empty()) return {};
    std::string html = "<h2>Expected</h2>\n<table><tr><th>expected</th><th></th><th>figures</th><th>why</th></tr>\n";
    for (const Expectation& one : expected)
        html += fmt::format(
            "<tr class=\"{}\"><td>{}</td><td>{}</td><td>{}</td><td class=\"why\">{}</td></tr>\n",
            one.state == Expectation::State::NotMet ? "unmet" : "", escaped(one.text), nameOf(one.state),
            escaped(one.figures), escaped(one.why));
    return html + "</table>\n";
}

Result<std::string> section(const TradeResult& result) {
    std::string html = fmt::format("<h1>Speed against accuracy: {}</h1>\n", escaped(result.scene));
    html += fmt::format("<p>{}x{} pixels, {:.1f} % of the covered ones judged. Truth: {}.<br>Umbriel {}, {}.</p>\n",
                        result.width, result.height, 100.0 * result.judgedShare, escaped(result.truth),
                        escaped(result.version), escaped(result.machine));
    html +=
        "<p>Outlined points on the dashed line are the front: nothing else is both cheaper and more accurate.</p>\n";
    if (!result.rows.empty()) html += frontSvg(result);
    html +=
        "<h2>Rows</h2>\n<table><tr><th>setting</th><th>error %</th><th>leak %</th><th>acne %</th><th>away from edges "
        "%</th>"
        "<th>edge px</th><th>p95 px</th><th>RMSE</th><th>near / middle / far %</th><th>wall ms</th><th>CPU "
        "ms</th><th>map "
        "KiB</th></tr>\n";
    const auto pixels = [](double value) {
        return std::isfinite(value) ? fmt::format("{:.1f}", value) : std::string("&ndash;");
    };
    for (const TradeRow& row : result.rows) {
        const TradeErrors& e = row.errors;
        html += fmt::format(
            "<tr "
            "class=\"{}\"><td>{}</td><td>{:.3f}</td><td>{:.3f}</td><td>{:.3f}</td><td>{:.3f}</td><td>{}</td><td>{}</td>"
            "<td>{:.4f}</td><td>{:.3f} / {:.3f} / {:.3f}</td><td>{:.1f}</td><td>{:.1f}</td><td>{}</td></tr>\n",
            row.chosen    ? "chosen"
            : row.onFront ? "front"
                          : "",
            escaped(labelOf(row.setting)), 100 * e.error.error(), 100 * e.error.leak, 100 * e.error.acne,
            100 * e.error.errorAway(), pixels(e.edges.distance.median), pixels(e.edges.distance.percentile95),
            e.error.rmse, 100 * e.zoneErrors[0], 100 * e.zoneErrors[1], 100 * e.zoneErrors[2],
            row.cost.wallMilliseconds, row.cost.cpuMilliseconds, row.cost.mapBytes / 1024);
    }
    html += "</table>\n";
    for (const std::string& note : result.notes) html += fmt::format("<p>{}</p>\n", escaped(note));

    html +=
        "<h2>Pictures</h2>\n<p>The share of the first light that arrives; grey-blue where it is not judged. "
        "Difference: "
        "<span style=\"color:#c00\">red</span> lit where truth is dark, <span style=\"color:#22f\">blue</span> dark "
        "where truth is "
        "lit.</p>\n";
    const int width = result.truthFactors.width(), height = result.truthFactors.height();
    const auto at = [&](const FloatImage& image, int x, int y) { return static_cast<double>(image.at(x, y, 0)); };
    const std::vector<std::uint8_t>* mask = &result.judged;
    const auto judged = [&](int x, int y) {
        return (*mask)[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                             static_cast<std::size_t>(x)] != 0;
    };
    const auto shown = [&](const FloatImage& image) {
        return picture(
            width, height,
            [&](int x, int y) {
                const double f = 0.05 + 0.85 * at(image, x, y);
                return judged(x, y) ? Rgb{f, f, f} : Rgb{0.6 * f, 0.7 * f, 0.8 * f};
            },
            false);
    };
    if (width == 0 || height == 0) return html;
    for (const TradeRow& row : result.rows) {
        if (row.factors.width() != width || row.factors.height() != height) continue;
        mask = row.judged.empty() ? &result.judged : &row.judged;
        auto drawn = shown(row.factors);
        if (!drawn) return drawn.error();
        auto truth = shown(result.truthFactors);
        if (!truth) return truth.error();
        auto difference = picture(
            width, height,
            [&](int x, int y) {
                const double f = 0.3 + 0.3 * at(result.truthFactors, x, y);
                const double d = judged(x, y) ? at(row.factors, x, y) - at(result.truthFactors, x, y) : 0.0;
                const double keep = f * (1.0 - std::abs(d));
                return Rgb{keep + std::max(0.0, d) * 0.8, keep, keep + std::max(0.0, -d)};
            },
            true);
        if (!difference) return difference.error();
        html += fmt::format(
            "<h3>{}</h3>\n<figure>{}<figcaption>result</figcaption></figure><figure>{}<figcaption>truth</figcaption>"
            "</figure><figure>{}<figcaption>difference: {:.3f} %</figcaption></figure>\n",
            escaped(labelOf(row.setting)), *drawn, *truth, *difference, 100 * row.errors.error.error());
    }
    return html;
}

}  // namespace

Result<std::string> tradeHtml(std::span<const TradeResult> results, std::span<const Expectation> expected) {
    std::string html = fmt::format(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>Umbriel trade: {0}</title>\n<style>\n"
        "body{{font:14px/1.4 sans-serif;margin:24px;max-width:1200px;color:#222}}\n"
        "table{{border-collapse:collapse}}td,th{{padding:3px 9px;text-align:right;border-bottom:1px solid #ddd}}\n"
        "td:first-child,th:first-child,td.why{{text-align:left}}tr.front{{background:#f0f5fa}}"
        "tr.chosen{{background:#ffe9b8}}tr.unmet{{background:#fbe9e7}}\n"
        "figure{{display:inline-block;margin:0 8px 8px "
        "0}}figcaption{{font-size:12px;color:#555}}img{{image-rendering:pixelated}}\n"
        "h3{{margin:20px 0 4px}}\n</style></head><body>\n",
        results.empty() ? std::string() : escaped(results.front().scene));
    html += expectationTable(expected);
    for (const TradeResult& result : results) {
        auto one = section(result);
        if (!one) return one.error();
        html += *one;
    }
    return html + "</body></html>\n";
}

}  // namespace umbriel
