#include <unistd.h>

#include <algorithm>
#include <climits>
#include <cstdlib>

#include "base/log.h"
#include "deck/deck.h"
#include "deck/deck_state.h"
#include "deck/keyword_table.h"

namespace {

// folders searched for pages: MPFE_DOC, the source tree, the installation
std::vector<std::string> page_folders()
{
  std::vector<std::string> folder;
  if (const char* doc = std::getenv("MPFE_DOC")) folder.push_back(std::string(doc) + "/keywords/");
  char path[PATH_MAX];
  const ssize_t n = readlink("/proc/self/exe", path, sizeof path);
  if (n > 0 && n < static_cast<ssize_t>(sizeof path)) {
    const std::string program(path, static_cast<std::size_t>(n));
    const std::string up = program.substr(0, program.rfind('/')) + "/../";
    folder.push_back(up + "doc/keywords/");
    folder.push_back(up + "share/mpfe/doc/keywords/");
  }
  return folder;
}

bool print_page(const std::string& path, std::FILE* out)
{
  std::FILE* page = std::fopen(path.c_str(), "r");
  if (!page) return false;
  char part[4096];
  for (std::size_t n; (n = std::fread(part, 1, sizeof part, page)) > 0;) std::fwrite(part, 1, n, out);
  std::fclose(page);
  return true;
}

}  // namespace

// ---------------------------------------------------------------------------
// deck_help : prints the page of a keyword; without a page, its help line and parameters
// ---------------------------------------------------------------------------
bool deck_help(const std::string& keyword, std::FILE* out)
{
  std::string word = keyword.substr(!keyword.empty() && keyword[0] == '*');
  std::replace(word.begin(), word.end(), '_', ' ');
  const Keyword* k = keyword_find(word);
  if (!k) {
    std::vector<std::string> valid;
    for (int i = 0; i < keyword_count; ++i) valid.push_back(keyword_table[i].word);
    std::string upper = word;
    for (char& c : upper) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    const std::string nearest = text_nearest(upper, valid);
    log_error("no keyword *%s%s", upper.c_str(),
              nearest.empty() ? "; mpfe --list-keywords lists all"
                              : ("; did you mean *" + nearest + "?").c_str());
    return false;
  }
  std::string name = k->word;
  std::replace(name.begin(), name.end(), ' ', '_');
  for (const std::string& folder : page_folders())
    if (print_page(folder + name + ".md", out)) return true;
  std::fprintf(out, "*%s: %s\n  parameters: %s\n", k->word, k->help, *k->params ? k->params : "none");
  std::fprintf(out, "  (the page doc/keywords/%s.md was not found; MPFE_DOC names the folder doc)\n",
               name.c_str());
  return true;
}
