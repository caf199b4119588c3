#include "postproc/jobs/batch.h"

#include <sys/wait.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>

#include "postproc/jobs/batch_file.h"
#include "tests/support/support.h"

using namespace smoothpost;
namespace fs = std::filesystem;

namespace {

const std::string kTool = std::string(SMOOTHPOST_BINARY_DIR) + "/bin/smoothpost";

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t found = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
  return found;
}

void store(const fs::path& path, const std::string& text) { std::ofstream(path) << text; }

std::string number(int i) { return (i < 10 ? "0" : "") + std::to_string(i); }

/// Twenty jobs on a table: CSV paths that differ in one coordinate. Job 20 calls a subroutine in a
/// file of its own.
class Shop {
 public:
  explicit Shop(const std::string& name)
      : folder_(fs::path(SMOOTHPOST_BINARY_DIR) / "batch_test" / name) {
    fs::remove_all(folder_);
    fs::create_directories(folder_ / "table");
    fs::copy(test::source_path("machines/table_table_bc/machine.toml"), folder_ / "table");
    std::string jobs =
        "[defaults]\nmachine = \"table/machine.toml\"\nno-collision-check = true\n"
        "schedule = \"programmed\"\nsmoothing = \"none\"\n";
    for (int i = 1; i <= 19; ++i) {
      write_part(i, "2");
      jobs += "[[job]]\ninput = \"part" + number(i) + ".csv\"\n";
    }
    store(folder_ / "part20.ngc", "G21 G90\nG0 X0 Y0 Z5\nF300\no<slot> call\nM30\n");
    write_slot("8");
    jobs += "[[job]]\ninput = \"part20.ngc\"\n";
    store(file(), jobs);
    set_worker("");
  }

  std::string file() const { return (folder_ / "shop.toml").string(); }
  fs::path at(const std::string& path) const { return folder_ / path; }
  std::string read(const std::string& path) const { return test::read_bytes(folder_ / path); }

  void write_part(int i, const std::string& y) const {
    store(folder_ / ("part" + number(i) + ".csv"),
          "x_mm,y_mm,z_mm,i,j,k,feed_mm_per_min\n0,0,0,0,0,1,600\n" + std::to_string(i) +
              ",0,0,0,0,1,600\n" + std::to_string(i) + "," + y + ",0,0,0,1,600\n");
  }
  void write_slot(const std::string& x) const {
    store(folder_ / "slot.ngc", "o<slot> sub\nG1 Z0\nG1 X" + x + "\nG1 Z5\no<slot> endsub\n");
  }

  /// A worker that counts its jobs and then is the tool; `first` comes before.
  void set_worker(const std::string& first) const {
    store(folder_ / "worker.sh", "#!/bin/sh\necho \"$4\" >> '" + at("ran").string() + "'\n" +
                                     first + "\nexec '" + kTool + "' \"$@\"\n");
    fs::permissions(folder_ / "worker.sh", fs::perms::owner_all);
  }

  Options options(const std::string& at_once = "4") const {
    Options o;
    o.command = "batch";
    o.arguments = {file()};
    o.jobs = at_once;
    o.worker = at("worker.sh").string();
    return o;
  }

  JobResult run(const std::string& at_once = "4") const { return run_job(options(at_once), {}); }

  /// The same as a process: its exit status, or 128 and the signal's number.
  int run_process() const {
    const std::string command = "exec '" + kTool + "' batch '" + file() + "' --jobs 1 --worker '" +
                                at("worker.sh").string() + "' > '" + at("said").string() + "' 2>&1";
    const int status = std::system(command.c_str());
    return WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
  }

  /// Jobs that were run since the last call, sorted.
  std::set<std::string> ran() const {
    std::set<std::string> names;
    std::ifstream in(at("ran"));
    for (std::string name; std::getline(in, name);) names.insert(name);
    in.close();
    fs::remove(at("ran"));
    return names;
  }

 private:
  fs::path folder_;
};

int status(const JobResult& result) {
  for (const auto& d : result.diagnostics) UNSCOPED_INFO(to_string(d));
  UNSCOPED_INFO(result.text);
  return static_cast<int>(result.status);
}

using Names = std::set<std::string>;

std::vector<std::string> codes(const std::string& text) {
  const fs::path folder = fs::path(SMOOTHPOST_BINARY_DIR) / "batch_test/file";
  fs::create_directories(folder);
  store(folder / "jobs.toml", text);
  const auto file = read_batch_file((folder / "jobs.toml").string());
  std::vector<std::string> found;
  for (const auto& d : file.diagnostics()) {
    CHECK(d.where.file == (folder / "jobs.toml").string());
    found.push_back(d.code);
  }
  return found;
}

}  // namespace

TEST_CASE("read_batch_file: defaults give way to a job's own options and paths follow the file",
          "[postproc][jobs][batch]") {
  const fs::path folder = fs::path(SMOOTHPOST_BINARY_DIR) / "batch_test/good";
  fs::create_directories(folder);
  store(folder / "jobs.toml",
        "results = \"made\"\n[defaults]\nmachine = \"robot_6r\"\ntool = [\"1=60\", \"2=70\"]\n"
        "report = \"pages/{name}.html\"\n"
        "[[job]]\ninput = \"a.ngc\"\n"
        "[[job]]\nname = \"b2\"\ninput = \"/parts/b.ngc\"\ntool = \"3=80\"\n"
        "machine = \"own/machine.toml\"\noutput = \"b.src\"\n");
  const auto file = read_batch_file((folder / "jobs.toml").string());
  REQUIRE(file.ok());
  REQUIRE(file.value().jobs.size() == 2);
  const auto& a = file.value().jobs[0];
  const auto& b = file.value().jobs[1];
  CHECK(a.name == "a");
  CHECK(a.options.command == "convert");
  CHECK(a.options.input == (folder / "a.ngc").string());
  CHECK(a.options.machine == "robot_6r");
  CHECK(a.options.tool == std::vector<std::string>{"1=60", "2=70"});
  CHECK(a.options.report == (folder / "pages/a.html").string());
  CHECK(a.options.json == (folder / "made/a.json").string());
  CHECK(a.options.output == (folder / "made/a.{extension}").string());
  CHECK(b.options.input == "/parts/b.ngc");
  CHECK(b.options.tool == std::vector<std::string>{"3=80"});
  CHECK(b.options.machine == (folder / "own/machine.toml").string());
  CHECK(b.options.output == (folder / "b.src").string());
  CHECK(a.settings_sha256 != b.settings_sha256);
}

TEST_CASE("read_batch_file: every fault has its code and place", "[postproc][jobs][batch]") {
  using Codes = std::vector<std::string>;
  const std::string job = "[[job]]\ninput = \"a.ngc\"\n";
  CHECK(codes(job).empty());
  CHECK(codes("") == Codes{"US180"});
  CHECK(codes("result = \"x\"\n" + job) == Codes{"US180"});
  CHECK(codes(job + "machin = \"x\"\n") == Codes{"US152"});
  CHECK(codes(job + "jobs = \"2\"\n") == Codes{"US152"});
  CHECK(codes(job + "command = \"golden\"\n") == Codes{"US180"});
  CHECK(codes("[[job]]\nname = \"a\"\n") == Codes{"US180"});
  CHECK(codes(job + "[[job]]\nname = \"A\"\ninput = \"b.ngc\"\n") == Codes{"US181"});
  CHECK(codes(job + "name = \"a/b\"\n") == Codes{"US181"});
  CHECK(codes(job + "name = \"summary\"\n") == Codes{"US181"});
  CHECK(codes("[defaults]\nreport = \"r.html\"\n" + job + "[[job]]\ninput = \"b.ngc\"\n") ==
        Codes{"US182"});
  CHECK(codes(job + "output = \"x.ngc\"\n[[job]]\ninput = \"./x.ngc\"\n") == Codes{"US182"});
  CHECK(codes("[[job]\n") == Codes{"MF101"});
}

TEST_CASE("batch: a refused job and an unreadable one and a crash stop no other",
          "[postproc][jobs][batch]") {
  const Shop shop("faults");
  shop.write_part(3, "9000");                                            // beyond the table's reach
  store(shop.at("part05.csv"), "x_mm,y_mm,z_mm,i,j,k\nno,0,0,0,0,1\n");  // no number
  shop.set_worker("if [ \"$4\" = part07 ]; then kill -SEGV $$; fi");
  const JobResult result = shop.run();
  CHECK(status(result) == 1);
  CHECK(shop.ran().size() == 20);
  CHECK(count(result.text, ": certified\n") == 17);
  CHECK(contains(result.text, "part03: refused: "));
  CHECK(
      contains(result.text, "part05: refused: " + shop.at("part05.csv").string() + ":1: error"));
  CHECK(contains(result.text, "part07: crashed: the process was ended by signal 11\n"));
  CHECK(std::count_if(result.diagnostics.begin(), result.diagnostics.end(),
                      [](const Diagnostic& d) { return d.code == "IN103"; }) == 1);
  CHECK(contains(shop.read("shop_results/part05.log"), "error"));
  CHECK(fs::exists(shop.at("shop_results/part20.ngc")));
  CHECK_FALSE(fs::exists(shop.at("shop_results/part03.ngc")));
  CHECK(contains(shop.read("shop_results/part03.json"), "\"verdict\": \"refused\""));
  const std::string page = shop.read("shop_results/summary.html");
  CHECK(page == result.page);
  CHECK(contains(page, "17 OF 20"));
  CHECK(contains(page, "<a href=\"part20.ngc\">program</a>"));
  CHECK_FALSE(contains(page, "://"));
  CHECK(contains(shop.read("shop_results/summary.json"), "\"verdict\": \"crashed\""));

  // Only what did not succeed is run again.
  shop.write_part(3, "3");
  shop.write_part(5, "3");
  shop.set_worker("");
  CHECK(status(shop.run()) == 0);
  CHECK(shop.ran() == Names{"part03", "part05", "part07"});
}

TEST_CASE("batch: a finished job runs again only when something that it depends on has changed",
          "[postproc][jobs][batch]") {
  const Shop shop("restart");
  CHECK(status(shop.run()) == 0);
  CHECK(shop.ran().size() == 20);
  const std::string summary = shop.read("shop_results/summary.json");
  const std::string page = shop.read("shop_results/summary.html");
  const std::string program = shop.read("shop_results/part09.ngc");

  CHECK(status(shop.run()) == 0);
  CHECK(shop.ran().empty());
  CHECK(shop.read("shop_results/summary.json") == summary);

  shop.write_part(2, "4");                                  // an input
  shop.write_slot("9");                                     // a subroutine's file
  store(shop.at("shop_results/part09.ngc"), "not ours\n");  // an output
  fs::remove(shop.at("shop_results/part11.json"));
  CHECK(status(shop.run("1")) == 0);
  CHECK(shop.ran() == Names{"part02", "part09", "part11", "part20"});
  CHECK(shop.read("shop_results/part09.ngc") == program);

  shop.write_part(2, "2");
  shop.write_slot("8");
  CHECK(status(shop.run()) == 0);
  CHECK(shop.ran() == Names{"part02", "part20"});
  CHECK(shop.read("shop_results/summary.json") == summary);  // whatever ran when
  CHECK(shop.read("shop_results/summary.html") == page);

  std::string jobs = shop.read("shop.toml");  // an option of one job
  jobs.insert(jobs.find("input = \"part04"), "tip-tolerance = \"0.02\"\n");
  store(shop.file(), jobs);
  CHECK(status(shop.run()) == 0);
  CHECK(shop.ran() == Names{"part04"});

  std::ofstream(shop.at("table/machine.toml"), std::ios::app) << "# a line more\n";
  CHECK(status(shop.run()) == 0);
  CHECK(shop.ran().size() == 20);
}

TEST_CASE("batch: killed or interrupted it goes on where it was", "[postproc][jobs][batch]") {
  const bool kill = GENERATE(true, false);
  const Shop shop(kill ? "killed" : "interrupted");
  shop.set_worker("if [ \"$4\" = part08 ]; then kill -" + std::string(kill ? "KILL" : "INT") +
                  " $PPID; sleep 1; exit 9; fi");
  CHECK(shop.run_process() == (kill ? 128 + 9 : 2));
  const Names before = shop.ran();
  CHECK(before.size() == 8);
  if (!kill) CHECK(contains(shop.read("said"), "[US190]"));

  shop.set_worker("");
  CHECK(shop.run_process() == 0);
  const Names after = shop.ran();
  CHECK(after.size() == 13);
  CHECK(after.count("part07") == 0);
  CHECK(after.count("part08") == 1);
  CHECK(contains(shop.read("said"), "20 jobs: 20 certified; 7 finished before"));
  for (const auto& entry : fs::recursive_directory_iterator(shop.at("shop_results")))
    CHECK_FALSE(contains(entry.path().filename().string(), ".new"));
}

TEST_CASE("batch: --list and --only are enough for another engine", "[postproc][jobs][batch]") {
  const Shop shop("only");
  Options o = shop.options();
  o.list = true;
  const JobResult list = run_job(o, {});
  CHECK(status(list) == 0);
  CHECK(count(list.text, "\n") == 20);
  CHECK(list.text.substr(0, 14) == "part01\npart02\n");

  o.list = false;
  o.only = "part02";
  const JobResult one = run_job(o, {});
  CHECK(status(one) == 0);
  CHECK(one.verdict == "certified");
  CHECK(shop.read("shop_results/part02.ngc") == one.program);
  CHECK(status(shop.run()) == 0);
  CHECK(shop.ran().count("part02") == 0);
  const JobResult again = run_job(o, {});
  CHECK(status(again) == 0);
  CHECK(contains(again.summary, "part02 was finished before"));
  CHECK(again.program.empty());

  o.only = "part99";
  CHECK(status(run_job(o, {})) == 2);
}

TEST_CASE("batch: options that make no sense start nothing", "[postproc][jobs][batch]") {
  const Shop shop("senseless");
  for (const char* jobs : {"0", "1.5", "many", "2000"}) CHECK(status(shop.run(jobs)) == 2);
  Options o = shop.options();
  o.worker = shop.at("no such file").string();
  CHECK(status(run_job(o, {})) == 2);
  o = shop.options();
  const Progress no{[](const char*, double) { return false; }};
  CHECK(status(run_job(o, no)) == 2);
  CHECK(shop.ran().size() <= 4);
}
