// ---------------------------------------------------------------------------
// expr.h : a number or a function of x, y, z, t (muParser does the parsing)
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_EXPR_H
#define MPFE_BASE_EXPR_H

#include <map>
#include <memory>
#include <string>

struct ExprCode;                    // compiled form, private to expr.cpp

struct Expr {
  double value = 0.0;               // the number, when code is empty
  std::string text;                 // as the user wrote it
  std::shared_ptr<ExprCode> code;   // empty: a plain number
  bool is_const() const { return !code; }
};

using ParamMap = std::map<std::string, double>;

Expr expr_number(double value);

// expr_compile : text -> function of x, y, z, t; names of param and pi are constants.
// Returns false with a message and the 0-based position of the offending character.
bool expr_compile(const std::string& text, const ParamMap& param, Expr& out,
                  std::string& error, int& position);

// expr_scalar : text -> number (no x, y, z, t); same errors as expr_compile.
bool expr_scalar(const std::string& text, const ParamMap& param, double& value,
                 std::string& error, int& position);

// expr_constants : names and values of the parameters in its text; expr_compile gives the same function with
// them
ParamMap expr_constants(const Expr& e);

// expr_same : the same number, or the same text with the same parameters
bool expr_same(const Expr& a, const Expr& b);

// expr_eval : value at x[3] (length), t (time)
double expr_eval(const Expr& e, const double x[3], double t);

#endif
