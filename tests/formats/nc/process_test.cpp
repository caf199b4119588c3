#include <catch2/catch.hpp>

#include "formats/nc/event_words.h"
#include "tests/formats/nc/recording.h"

namespace smoothpost::test {
namespace {

using Texts = std::vector<std::string>;

ProcessTable table(const std::vector<std::pair<const char*, const char*>>& rows) {
  ProcessTable out;
  for (const auto& [event, text] : rows) {
    EventWords words;
    words.event = event;
    words.text = text;
    out.events.push_back(words);
  }
  return out;
}

nc::InterpreterSettings with(ProcessTable process) {
  nc::InterpreterSettings settings;
  settings.process = std::move(process);
  return settings;
}

nc::InterpreterSettings commenting() {
  nc::InterpreterSettings settings = mill_settings();
  settings.process.unmapped = UnmappedWords::comment;
  return settings;
}

const ProcessTable kLaser = table({{"beam_on", "M62 P0"},
                                   {"beam_off", "M63 P0"},
                                   {"pierce", "M62 P0"},
                                   {"gas_on", "M64 P1"},
                                   {"power", "M67 E0 Q{percent}"},
                                   {"stop", "M0"},
                                   {"message", "(MSG, {text})"}});

}  // namespace

TEST_CASE("process: words become events with their values", "[formats][nc][process]") {
  const Run r = run_lines("T1 M6 S630 M3 M8\nG0 X1\nM5 M9\nM1", mill_settings());
  REQUIRE(r.ok);
  CHECK(r.sink.event_texts() == Texts{"tool_change tool=1", "spindle_on rpm=630", "coolant_on",
                                      "spindle_off", "coolant_off", "optional_stop"});
  CHECK(r.sink.events[1].line == 1);
  CHECK(r.sink.events[1].column == 12);
  CHECK(r.summary.tools == std::vector<int>{1});
}

TEST_CASE("process: values are the shortest decimal text", "[formats][nc][process]") {
  CHECK(run_lines("M3 S630.", mill_settings()).sink.event_texts() == Texts{"spindle_on rpm=630"});
  CHECK(run_lines("M3 S0.10", mill_settings()).sink.event_texts() == Texts{"spindle_on rpm=0.1"});
  CHECK(run_lines("M3 S12000000", mill_settings()).sink.event_texts() ==
        Texts{"spindle_on rpm=12000000"});
}

TEST_CASE("process: S and T are modal", "[formats][nc][process]") {
  const Run r = run_lines("S500\nT2\nM3\nM6\nS500\nS700\nM5\nS800\nM4", mill_settings());
  CHECK(r.sink.event_texts() == Texts{"spindle_on rpm=500", "tool_change tool=2",
                                      "spindle_on rpm=700", "spindle_off",
                                      "spindle_on_reverse rpm=800"});
}

TEST_CASE("process: a changed S repeats the event before the motion of its line",
          "[formats][nc][process]") {
  const Run r = run_lines("M3 S100\nG0 X1\nG1 X2 F100 S200\nM3 S300\nS400 M5", mill_settings());
  const auto events = r.sink.of("event");
  REQUIRE(events.size() == 4);
  CHECK(events[1].text == "spindle_on rpm=200");
  CHECK(events[1].motions_before == 1);
  CHECK(events[2].text == "spindle_on rpm=300");
  CHECK(events[3].text == "spindle_off");
}

TEST_CASE("process: fixed words, first of equal rows, more fixed words first",
          "[formats][nc][process]") {
  const Run r = run_lines("M62 P0\nM67 E0 Q82.5\nM63 P0\nM64 P1", with(kLaser));
  REQUIRE(r.ok);
  CHECK(r.sink.event_texts() == Texts{"beam_on", "power percent=82.5", "beam_off", "gas_on"});
  const ProcessTable rows = table({{"any", "M64 P{port}"}, {"gas", "M64 P1"}});
  CHECK(run_lines("M64 P1\nM64 P2", with(rows)).sink.event_texts() == Texts{"gas", "any port=2"});
  const ProcessTable more = table({{"plain", "M3"}, {"speed", "M3 S{rpm}"}});
  CHECK(run_lines("M3 S5\nM3", with(more)).sink.event_texts().front() == "speed rpm=5");
}

TEST_CASE("process: a row of two M words", "[formats][nc][process]") {
  const Run r = run_lines("M8 M3 S5\nM8", with(table({{"both", "M3 M8 S{rpm}"}, {"flood", "M8"}})));
  CHECK(r.sink.event_texts().front() == "both rpm=5");
  CHECK(r.sink.event_texts().back() == "flood");
}

TEST_CASE("process: I/O before the motion of its line, stops after it", "[formats][nc][process]") {
  const Run r = run_lines("G0 X0\nG1 X1 F10 M62 P0 M0", with(kLaser));
  const auto events = r.sink.of("event");
  REQUIRE(events.size() == 2);
  CHECK(events[0].text == "beam_on");
  CHECK(events[0].motions_before == 1);
  CHECK(events[1].text == "stop");
  CHECK(events[1].motions_before == 2);
}

TEST_CASE("process: a mill's spindle words are no laser words", "[formats][nc][process]") {
  const Run r = run_lines("G0 X1\nS630 M03\nM104 S205\nM3", with(kLaser));
  CHECK(r.errors() == Texts{"PR101", "PR101"});  // each word once
  CHECK(r.all_text().find("t.ngc:2:6: error: M03") != std::string::npos);
  for (const char* remedy :
       {"[process.events]", "--process FILE", "process.unmapped = \"comment\""}) {
    CHECK(r.all_text().find(remedy) != std::string::npos);
  }
  CHECK(run_lines("M62 P5", with(kLaser)).errors() == Texts{"PR101"});
  CHECK(run_lines("M67 E0", with(kLaser)).errors() == Texts{"PR103"});
  CHECK(run_lines("M0\nM1", with(kLaser)).errors() == Texts{"PR101"});
  CHECK(run_lines("E5", with(kLaser)).errors() == Texts{"PR101"});
}

TEST_CASE("process: words that belong to nothing", "[formats][nc][process]") {
  CHECK(run_lines("M3 S5 P4", mill_settings()).errors() == Texts{"NC215"});
  CHECK(run_lines("M67 E0 Q5 P4", with(kLaser)).errors() == Texts{"NC215"});
  for (const char* word : {"L3", "Q3", "R3", "P3", "H3", "D3"}) {
    CHECK(run_lines(word, mill_settings()).errors() == Texts{"NC215"});
    CHECK(run_lines(word, commenting()).errors() == Texts{"NC215"});
  }
}

TEST_CASE("process: M words on one line", "[formats][nc][process]") {
  CHECK(run_lines("M3 S1 M5", mill_settings()).errors() == Texts{"NC207"});
  CHECK(run_lines("M7 M9", commenting()).errors() == Texts{"NC207"});
  CHECK(run_lines("M62 P1 M67 E0 Q1", commenting()).errors() == Texts{"NC207"});
  CHECK(run_lines("M0 M30", mill_settings()).errors() == Texts{"NC207"});
  CHECK(run_lines("M3 S1 M6 M8 M48 M0", commenting()).errors() == Texts{"NC208"});
}

TEST_CASE("process: unmapped words as comments", "[formats][nc][process]") {
  const Run r = run_lines(
      "M104 S205 T1\nG0 X1 Y1\nm 7\nG1 E12.000 F4550\nG92 E0\nX2 E1.5\nM66 P0 L3 Q2\nM3 S9",
      commenting());
  INFO(r.all_text());
  REQUIRE(r.ok);
  CHECK(r.sink.comments == Texts{"unmapped: M104 S205 T1", "unmapped: M7", "unmapped: E12.000",
                                 "unmapped: G92 E0", "unmapped: E1.5", "unmapped: M66 P0 L3 Q2"});
  CHECK(r.sink.motions.size() == 2);
  CHECK(r.sink.motions[1].duration == Approx(1.0 / 4550 * 60));  // F of the commented line is modal
  CHECK(r.sink.event_texts() == Texts{"spindle_on rpm=9"});
  CHECK(run_lines("M104 S205\nM3", commenting()).sink.event_texts() == Texts{"spindle_on rpm=0"});
}

TEST_CASE("process: what a known row uses does not go with an unmapped word",
          "[formats][nc][process]") {
  const Run r = run_lines("M3 S100 M104 P2", commenting());
  CHECK(r.sink.event_texts() == Texts{"spindle_on rpm=100"});
  CHECK(r.sink.comments == Texts{"unmapped: M104 P2"});
  const Run arc = run_lines("F10 G0 X0 Y0\nG2 X10 R10 M104 L4", commenting());
  REQUIRE(arc.ok);
  CHECK(arc.sink.comments == Texts{"unmapped: M104 L4"});
}

TEST_CASE("process: a commented tool change still names the tool", "[formats][nc][process]") {
  nc::InterpreterSettings settings = with({});
  settings.process.unmapped = UnmappedWords::comment;
  settings.tool_lengths = {{2, 20.0}};
  const Run r = run_lines("T2 M6\nG43", settings);
  REQUIRE(r.ok);
  CHECK(r.sink.comments == Texts{"unmapped: T2 M6"});
  CHECK(r.sink.of("tool_length").at(0).integer == 2);
}

TEST_CASE("process: letters with a row of their own", "[formats][nc][process]") {
  const Run r = run_lines("G0 X0\nG1 X1 E1.5 F60\nE2", with(table({{"extrude", "E{length}"}})));
  REQUIRE(r.ok);
  CHECK(r.sink.event_texts() == Texts{"extrude length=1.5", "extrude length=2"});
  CHECK(run_lines("G92 E0", with(table({{"extrude", "E{length}"}}))).errors() == Texts{"NC219"});
}

TEST_CASE("process: comments", "[formats][nc][process]") {
  const Run r = run_lines(
      "( plain text )\n; to the end \n(MSG, hello)\n( msg,  two )\n(a) G0 X1 (last)\n(DEBUG, "
      "#1)\n()\n"
      ";MSG, no message",
      mill_settings());
  CHECK(r.sink.comments ==
        Texts{"plain text", "to the end", "last", "DEBUG, 0.000000", "MSG, no message"});
  CHECK(r.sink.event_texts() == Texts{"message text=hello", "message text=two"});
  CHECK(r.codes(Severity::note) == Texts{"NC231"});
  CHECK(r.sink.of("comment").at(2).motions_before == 0);
}

TEST_CASE("process: rendering", "[formats][nc][process]") {
  EventWords words;
  words.event = "spindle_on";
  words.text = "M3 S{rpm}";
  CHECK(nc::render_event(words, {{"rpm", "630"}, {"other", "1"}}).value() == "M3 S630");
  const auto missing = nc::render_event(words, {});
  REQUIRE_FALSE(missing.ok());
  CHECK(missing.diagnostics().front().code == "PR110");
  CHECK(missing.diagnostics().front().text.find("rpm") != std::string::npos);
  words.text = "(MSG, {text})";
  CHECK(nc::render_event(words, {{"text", "a b"}}).value() == "(MSG, a b)");
  words.text = "M3 S{rpm";
  CHECK(nc::render_event(words, {{"rpm", "1"}}).diagnostics().front().code == "PR111");
}

TEST_CASE("process: what is read is written back the same", "[formats][nc][process]") {
  for (const EventWords& words : kLaser.events) {
    if (words.event == "pierce" || words.event == "message") continue;
    const auto text = nc::render_event(words, {{"percent", "45.5"}}).value();
    const Run r = run_lines(text, with(kLaser));
    INFO(text);
    REQUIRE(r.ok);
    REQUIRE(r.sink.events.size() == 1);
    CHECK(r.sink.events[0].name == words.event);
    CHECK(nc::render_event(words, r.sink.events[0].parameters).value() == text);
  }
}

TEST_CASE("process: a table that cannot be understood", "[formats][nc][process]") {
  for (const char* text : {"M3 S{rpm", "M3 S", "M", "3", "M3 S{}", "(MSG", "M{x}"}) {
    INFO(text);
    CHECK(run_lines("G0 X1", with(table({{"e", text}}))).errors() == Texts{"PR111"});
  }
  CHECK(run_lines("G0 X1", with(table({{"e", "G4 P1"}, {"f", "M3\nG4 P2"}, {"g", ""}}))).ok);
}

}  // namespace smoothpost::test
