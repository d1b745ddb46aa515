#include "base/expr.h"

#include <muParser.h>

#include <cctype>
#include <cmath>

struct ExprCode {
  mu::Parser parser;
  double x = 0.0, y = 0.0, z = 0.0, t = 0.0;
};

namespace {

double step_function(double s) { return s >= 0.0 ? 1.0 : 0.0; }

bool name_char(char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_'; }

// parser with the functions and constants of all expressions, and only the parameters that occur in the text:
// a deck may have thousands
void prepare(mu::Parser& parser, const ParamMap& param, const std::string& text)
{
  parser.DefineConst("pi", std::acos(-1.0));
  parser.DefineFun("heaviside", step_function);
  for (std::size_t first = 0, last; first < text.size(); first = last + 1) {
    for (last = first; last < text.size() && name_char(text[last]);) ++last;
    const auto p = param.find(text.substr(first, last - first));
    if (p != param.end()) parser.DefineConst(p->first, p->second);
  }
}

bool report(const mu::Parser::exception_type& e, std::string& error, int& position)
{
  error    = e.GetMsg();
  position = static_cast<int>(e.GetPos());
  return false;
}

}  // namespace

Expr expr_number(double value)
{
  Expr e;
  e.value = value;
  return e;
}

bool expr_compile(const std::string& text, const ParamMap& param, Expr& out,
                  std::string& error, int& position)
{
  auto code = std::make_shared<ExprCode>();
  try {
    prepare(code->parser, param, text);
    code->parser.DefineVar("x", &code->x);
    code->parser.DefineVar("y", &code->y);
    code->parser.DefineVar("z", &code->z);
    code->parser.DefineVar("t", &code->t);
    code->parser.SetExpr(text);
    code->parser.Eval();
  } catch (const mu::Parser::exception_type& e) {
    return report(e, error, position);
  }
  out.text = text;
  out.code = code;
  return true;
}

bool expr_scalar(const std::string& text, const ParamMap& param, double& value,
                 std::string& error, int& position)
{
  mu::Parser parser;
  try {
    prepare(parser, param, text);
    parser.SetExpr(text);
    value = parser.Eval();
  } catch (const mu::Parser::exception_type& e) {
    return report(e, error, position);
  }
  return true;
}

ParamMap expr_constants(const Expr& e) { return e.code ? e.code->parser.GetConst() : ParamMap(); }

bool expr_same(const Expr& a, const Expr& b)
{
  if (!a.code || !b.code) return !a.code && !b.code && a.value == b.value;
  return a.text == b.text && a.code->parser.GetConst() == b.code->parser.GetConst();
}

double expr_eval(const Expr& e, const double x[3], double t)
{
  if (!e.code) return e.value;
  e.code->x = x[0];
  e.code->y = x[1];
  e.code->z = x[2];
  e.code->t = t;
  return e.code->parser.Eval();
}
