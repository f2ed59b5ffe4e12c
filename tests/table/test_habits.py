"""Files as people write them: read right to the last digit, or refused with what settles it."""

import io
import json
import os
import pickle
import re
import threading
import zipfile

import numpy as np
import openpyxl
import pandas as pd
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from pymoo_psi import PsiError
from pymoo_psi.cli import main
from pymoo_psi.table import read_designs

COST = {"cost": [1.5, 2.25], "mass": [30.0, 2.5]}


def workbook(*sheets, edit=None):
    """A workbook with the sheets S0, S1, …; the last of them is edited."""
    book, stream = openpyxl.Workbook(), io.BytesIO()
    book.remove(book.active)
    for k, rows in enumerate(sheets):
        sheet = book.create_sheet(f"S{k}")
        for row in rows:
            sheet.append(row)
    if edit:
        edit(sheet)
    book.save(stream)
    return stream.getvalue()


def in_per_cent(*cells):
    def edit(sheet):
        for cell in cells:
            sheet[cell].number_format = "0.0%"

    return edit


def hide_row(number):
    def edit(sheet):
        sheet.row_dimensions[number].hidden = True

    return edit


TYPED = [["cost", "mass"], [1.5, 30], [2.25, 2.5]]

# What a file holds, the options given, and what must come of it: the numbers of each objective in
# their order, or the message.
FILES = {
    # Dividers
    "commas": ("cost,mass\n1.5,30\n2.25,2.5\n", {}, COST),
    "semicolons, decimal commas": ("cost;mass\n1,5;30\n2,25;2,5\n", {}, COST),
    "semicolons, decimal points": ("cost;mass\n1.5;30\n2.25;2.5\n", {}, COST),
    "tabs, decimal points": ("cost\tmass\n1.5\t30\n2.25\t2.5\n", {}, COST),
    "tabs, decimal commas": ("cost\tmass\n1,5\t30\n2,25\t2,5\n", {}, COST),
    "bars": ("cost|mass\n1.5|30\n2.25|2.5\n", {}, COST),
    "spaces": ("cost mass\n1.5 30\n2.25 2.5\n", {}, COST),
    "columns of spaces": ("  cost   mass\n   1.5     30\n  2.25    2.5\n", {}, COST),
    "commas, quoted decimal commas": ('cost,mass\n"1,5","30"\n"2,25","2,5"\n', {}, COST),
    "a name with a comma": (
        "time, s;mass\n1,5;2,5\n2;3\n",
        {},
        {"time, s": [1.5, 2.0], "mass": [2.5, 3.0]},
    ),
    "a name with a semicolon": (
        "time; wall,mass\n1.5,2.5\n2,3\n",
        {},
        {"time; wall": [1.5, 2.0], "mass": [2.5, 3.0]},
    ),
    "signs and exponents": (
        "cost;mass\r\n+1,5;3e1\r\n2,25;,25E+1\r\n",
        {},
        COST,
    ),
    "dashes for no cents": (
        "cost;mass\n1.200,-;12.--\n950,—;3.5\n",
        {},
        {"cost": [1200, 950], "mass": [12, 3.5]},
    ),
    "sep line": ("sep=;\ncost;mass\n1,5;30\n2,25;2,5\n", {}, COST),
    "quoted sep line": ('"sep=\t"\ncost\tmass\n1.5\t30\n2.25\t2.5\n', {}, COST),
    "sep line with a bar": ("sep=|\r\ncost|mass\r\n1.5|30\r\n2.25|2.5\r\n", {}, COST),
    "a comma at the end of lines": ("cost,mass,\n1.5,30,\n2.25,2.5,\n", {}, COST),
    "spaces behind commas": ("cost, mass\n1.5, 30\n2.25, 2.5\n", {}, COST),
    "blank lines between": ("\n\ncost,mass\n\n1.5,30\n , \n2.25,2.5\n\n", {}, COST),
    "lines that end in a return": ("cost,mass\r1.5,30\r2.25,2.5\r", {}, COST),
    "a name over two lines": (
        '"cost\nin €",mass\n1.5,30\n2.25,2.5\n',
        {},
        {"cost in €": [1.5, 2.25], "mass": [30, 2.5]},
    ),
    "a name over two lines, told by the file": (
        '# {"pymoo_psi_designs": 1, "objectives": ["cost\\nin €"], "maximized": [], "variables": [], '
        '"outputs": [], "units": {}}\n"cost\nin €",mass\n1.5,30\n2.25,2.5\n',
        {},
        {"cost in €": [1.5, 2.25]},
    ),
    "commas that divide decimal commas": (
        "cost,mass\n1,5,30\n2,25,2,5\n",
        {},
        r"row 1 \(line 2\) has 3 cells, the header 2",
    ),
    "one name, decimal commas": ("cost\n1,5\n2,25\n", {}, "line 1 has 1 cell, the lines below 2"),
    "a quotation mark left open": ('a,b\n1,"2\n3,4\n', {}, "unexpected end of data in line 3"),
    "a short row": ("a,b\n1,2\n3\n", {}, r"row 2 \(line 3\) has 1 cell, the header 2"),
    "a long row": ("a,b\n1,2,3\n3,4\n", {}, r"row 1 \(line 2\) has 3 cells, the header 2"),
    "thousands or two numbers": ("a b\n1 250\n2 300\n", {}, "'a b' is the only column .* --objectives"),
    # Points and commas: which divides thousands, which decimals
    "decimals and thousands in a column": (
        "a;b\n2,5;1\n1.250;2\n",
        {},
        {"a": [2.5, 1250.0], "b": [1, 2]},
    ),
    "both marks": ("a;b\n1.250,50;1\n980;2\n", {}, {"a": [1250.5, 980.0], "b": [1, 2]}),
    "both marks, English": ('a,b\n"1,250.50",1\n980,2\n', {}, {"a": [1250.5, 980.0], "b": [1, 2]}),
    "millions": ("a;b\n1.250.000;1\n2.500;2\n", {}, {"a": [1250000.0, 2500.0], "b": [1, 2]}),
    "millions, English": (
        'a,b\n"1,250,000",1\n"2,500",2\n',
        {},
        {"a": [1250000.0, 2500.0], "b": [1, 2]},
    ),
    "thousands beside decimal commas": (
        "cost;mass\n2,5;1.250\n3,5;980\n",
        {},
        r"row 1 \(line 2\) holds '1\.250' in the column 'mass', either 1250 or 1\.250; settle it by --thousands '\.' or --decimal '\.'",
    ),
    "the same with the decimal mark": (
        "cost;mass\n2,5;1.250\n3,5;980\n",
        {"decimal": ","},
        {"cost": [2.5, 3.5], "mass": [1250.0, 980.0]},
    ),
    "the same with that of thousands": (
        "cost;mass\n2,5;1.250\n3,5;980\n",
        {"thousands": "."},
        {"cost": [2.5, 3.5], "mass": [1250.0, 980.0]},
    ),
    "points only, semicolons": ("a;b\n1.250;3\n2.125;4\n", {}, "'1.250' .* settle it by --thous"),
    "points only, tabs": ("a\tb\n1.250\t3\n2.125\t4\n", {}, "'1.250' .* settle it by --thousands"),
    "points only, decimal": (
        "a;b\n1.250;3\n2.125;4\n",
        {"decimal": "."},
        {"a": [1.25, 2.125], "b": [3, 4]},
    ),
    "three decimals, commas": (
        "a,b\n1.250,3\n2.125,4\n",
        {},
        {"a": [1.25, 2.125], "b": [3, 4]},
    ),
    "three decimals or thousands, commas": (
        "a,b\n1.250,3\n980,4\n",
        {},
        "'1.250' in the column 'a', either 1250 or 1.250; settle it by --thousands",
    ),
    "three decimals, told by another column": (
        "a;b\n1.250;3.5\n980;4\n",
        {},
        {"a": [1.25, 980.0], "b": [3.5, 4]},
    ),
    "three decimals or thousands beside labels": (
        "id;a;b\n1.1;1.250;3\n1.2;980;4\n",
        {},
        "'1.250' in the column 'a', either 1250 or 1.250; settle it by --thousands",
    ),
    "three decimals, told by a leading zero": (
        "a;b\n0.125;3\n1.250;4\n",
        {},
        {"a": [0.125, 1.25], "b": [3, 4]},
    ),
    "three decimals, told by many digits": (
        "a;b\n1250.125;3\n1.250;4\n",
        {},
        {"a": [1250.125, 1.25], "b": [3, 4]},
    ),
    "three decimals with an exponent": (
        "a;b\n1.250E+03;3\n2.500e-1;4\n",
        {},
        {"a": [1250.0, 0.25], "b": [3, 4]},
    ),
    "a comma in front of three digits": (
        'a,b\n"1,250",3\n980,4\n',
        {},
        "'1,250' in the column 'a', either 1250 or 1.250; settle it by --thousands ',' or --dec",
    ),
    "the same with thousands": (
        'a,b\n"1,250",3\n980,4\n',
        {"thousands": ","},
        {"a": [1250.0, 980.0], "b": [3, 4]},
    ),
    "a decimal point in a column of commas": (
        "a;b\n1.5;2\n1,5;2\n",
        {},
        r"row 2 \(line 3\) holds '1,5' in the column 'a', with the decimal mark ,, while others",
    ),
    "thousands by points, decimals by points": (
        "a;b\n1.250.000;2\n1.5;2\n",
        {},
        r"row 2 \(line 3\) holds '1\.5' in the column 'a', with the decimal mark \.",
    ),
    "another mark than was said": (
        "a;b\n1.5;2\n2;2\n",
        {"decimal": ","},
        "holds '1.5' in the column 'a', no number with the decimal mark ,; .* --decimal",
    ),
    "spaces between thousands": (
        "a;b\n1 250;1\n2 500,5;2\n",
        {},
        {"a": [1250.0, 2500.5], "b": [1, 2]},
    ),
    "narrow spaces": (
        "a;b\n1\u202f250;1\n2\u00a0500,500;2\n",
        {},
        {"a": [1250.0, 2500.5], "b": [1, 2]},
    ),
    "apostrophes": ("a;b\n1'250.5;1\n2’500;2\n", {}, {"a": [1250.5, 2500.0], "b": [1, 2]}),
    "thousands said to be apostrophes": (
        "a;b\n1'250;1\n2.500;2\n",
        {"thousands": "'"},
        {"a": [1250.0, 2.5], "b": [1, 2]},
    ),
    "both marks beside gaps": (
        "a;b\n1.250,5;1\n2;2\n",
        {"thousands": "'"},
        "holds '1.250,5' in the column 'a', no number with the decimal mark ,;",
    ),
    "other marks beside gaps": (
        "a;b\n1.250;1\n1,250;2\n",
        {"thousands": " "},
        r"row 2 \(line 3\) holds '1,250' in the column 'a', with the decimal mark ,, while others",
    ),
    "columns that contradict each other": (
        "a;b;c\n1.5;2,5;1.250\n2.5;3,5;1,250\n",
        {},
        "'1.250' in the column 'c', either 1250 or 1.250; settle it",
    ),
    "groups of other sizes": ("a;b\n1.25.000;1\n2;2\n", {}, "'1.25.000' .*, text among numbers"),
    # Signs, units, currencies
    "minus of typesetters": ("a,b\n−1.5,30\n–2,2\n", {}, {"a": [-1.5, -2.0], "b": [30, 2]}),
    "plus": ("a,b\n+1.5,30\n2,2\n", {}, {"a": [1.5, 2.0], "b": [30, 2]}),
    "dollars": ("a,b\n$2.50,30\n$3,2\n", {}, {"a": [2.5, 3.0], "b": [30, 2]}),
    "less than no dollars": ("a,b\n-$2.50,30\n$-3,2\n", {}, {"a": [-2.5, -3.0], "b": [30, 2]}),
    "euros behind": ("a;b\n2,50 €;30\n1.250 €;2\n", {}, {"a": [2.5, 1250.0], "b": [30, 2]}),
    "codes of currencies": ("a;b\nEUR 2,50;30\nEUR 3;2\n", {}, {"a": [2.5, 3.0], "b": [30, 2]}),
    "percent": ("a,b\n85%,30\n90.5 %,2\n", {}, {"a": [85.0, 90.5], "b": [30, 2]}),
    "units": ("a,b\n12.5 kg,3 m/s\n7kg,4 m/s\n", {}, {"a": [12.5, 7.0], "b": [3, 4]}),
    "degrees": ("a,b\n12.5 °C,3°\n-7 °C,4°\n", {}, {"a": [12.5, -7.0], "b": [3, 4]}),
    "powers": ("a,b\n12.5 m²,3 kg/m^3\n7 m²,4 kg/m^3\n", {}, {"a": [12.5, 7.0], "b": [3, 4]}),
    "other units": (
        "a,b\n12 kg,3\n950 g,4\n",
        {},
        r"row 2 \(line 3\) holds '950 g' in the column 'a', in g, while the first .* is in kg",
    ),
    "percent beside shares": ("a,b\n85%,3\n0.9,4\n", {}, "'0.9' in the column 'a', in no unit"),
    "dollars beside euros": ("a;b\n$2;3\n€3;4\n", {}, "holds '€3' in the column 'a', in €"),
    "a unit that may be a name": ("a,b,c\n1,2,304L\n2,1,316L\n", {}, "'304L' .* like a number"),
    "a unit with a power that may be a name": ("a,b,c\n1,2,3m2\n2,1,4m2\n", {}, "'3m2' .* like a num"),
    "a steel, when it is not asked for": (
        "a,b,c\n1,2,304L\n2,1,316L\n",
        {"objectives": ["a", "b"]},
        {"a": [1, 2], "b": [2, 1]},
    ),
    "brackets for less than nothing": ("a,b\n(1.5),3\n2,4\n", {}, r"'\(1.5\)' .* text among numb"),
    "approximations": ("a,b,c\n1,3,~5\n2,4,~6\n", {}, "'~5' in the column 'c', like a number, but"),
    "inequalities": ("a,b,c\n1,3,<5\n2,4,<6\n", {}, "'<5' in the column 'c', like a number, but"),
    "ranges": ("a,b,c\n1,3,5-6\n2,4,6-7\n", {}, "'5-6' in the column 'c', like a number, but none"),
    "fractions": ("a,b,c\n1,3,1/2\n2,4,3/4\n", {}, "'1/2' in the column 'c', like a number, but"),
    "Python's thousands": ("a,b\n1_000,2\n2,1\n", {}, "'1_000' in the column 'a', text among numb"),
    "hexadecimal": ("a,b,c\n1,2,0x1F\n2,1,0x2F\n", {}, "'0x1F' in the column 'c', like a number"),
    "dates are text": (
        "day;a;b\n2024-05-01;1,5;2\n2024-05-02;2,5;3\n",
        {},
        {"a": [1.5, 2.5], "b": [2, 3]},
    ),
    "German dates are text": (
        "day;a;b\n01.05.2024;1,5;2\n02.05.2024;2,5;3\n",
        {},
        {"a": [1.5, 2.5], "b": [2, 3]},
    ),
    "a version is none": ("v;a;b\n1.2.3;1;2\n1.2.4;2;3\n", {}, "'1.2.3' in the column 'v', like a"),
    "text beside numbers": (
        "a,b\n1,2\noak,3\n",
        {},
        r"row 2 \(line 3\) holds 'oak' in the column 'a', text among numbers; .* --skip-rows 3",
    ),
    # Rows that summarise others
    "a sum": ("m;a;b\nA;1;4\nB;2;3\nC;4;2\nSumme:;7;9\n", {}, r"row 4 \(line 5\) is called 'Summe:' and summarises other rows; leave it out by --skip-rows 5, or rename"),
    "a sum left out": ("m;a;b\nA;1;4\nB;2;3\nC;4;2\nSumme:;7;9\n", {"skip_rows": [5]}, {"a": [1, 2, 4], "b": [4, 3, 2]}),
    "a sum beside a ratio": ("m,a,b\nA,1,4\nB,2,3\nTotal,3,2.33\n", {}, "'Total' and summarises"),
    "a sum of one column": ("m,a,b\nA,1,4\nB,2,3\nTotal,3,\n", {}, "'Total' and summarises"),
    "a sum called so by another column": ("a,b,remark\n1,4,\n2,3,\n3,7,Σ\n", {}, "'Σ' and summarises"),
    "a sum that is rounded": ("m,a,b\nA,1.24,4\nB,2.23,3\nTotal,3.5,7\n", {}, "'Total' and summarises"),
    "a rounded mean": ("m,a,b\nA,1,30\nB,2,2.5\nC,6,1\nMean,3,11.2\n", {}, "'Mean' and summarises"),
    "least and greatest": ("m,a,b\nA,1,4\nB,2,3\nmin,1,3\nmax,2,4\n", {}, r"row 3 \(line 4\) is called 'min' .* such rows out by --skip-rows 4,5,"),
    "statistics on top": ("m,a,b\nMedian,0.7,9\nMax.,2,4\nA,1,4\nB,2,3\n", {}, r"row 2 \(line 3\) is called 'Max.' .* such rows out by --skip-rows 2,3,"),
    "a sum of more digits than are shown": ("m,a,b\nA,1.24,4.4\nB,2.24,3.4\nC,8.24,2.4\nTotal,11.73,10.3\n", {}, "'Total' and summarises"),
    "a design called Total beside counts": ("m,a,b\nA,1,4\nB,2,3\nC,3,1\nTotal,5,9\n", {}, {"a": [1, 2, 3, 5], "b": [4, 3, 1, 9]}),
    "sums of groups": ("m,a,b\nA,1,4\nB,2,3\nAB Total,3,7\nC,8,1\nD,9,1\nCD Total,17,2\n", {}, "--skip-rows 4,7,"),
    "sums above groups": ("m,a,b\nTotal AB,3,7\nA,1,4\nB,2,3\nTotal CD,17,2\nC,8,1\nD,9,1\n", {}, "--skip-rows 2,5,"),
    "a sum of what a filter shows": (
        workbook([["m", "a", "b"], ["A", 1, 4], ["B", 2, 3], ["C", 4, 2], ["Total", 5, 6]], edit=hide_row(3)),
        {},
        "'Total' and summarises other rows; leave it out by --skip-rows 5",
    ),
    "a design called Total": ("m,a,b\nBP,1,4\nShell,2,3\nTotal,4,2\n", {}, {"a": [1, 2, 4], "b": [4, 3, 2]}),
    "a design called Max": ("m,a,b\nMin,1,4\nMid,2,4\nMax,3,4\n", {}, {"a": [1, 2, 3], "b": [4, 4, 4]}),
    "a design that shares the greatest": ("m,a,b\nEco,1,4\nMid,2,6\nMax,3,6\n", {}, {"a": [1, 2, 3], "b": [4, 6, 6]}),
    "levels called min and max": (
        "a,b,speed\n1,4,min\n3,6,max\n2,5,min\n4,7,max\n",
        {},
        {"a": [1, 3, 2, 4], "b": [4, 6, 5, 7]},
    ),
    "statistics beyond all numbers": (
        "m,a,b\nA,1.6e308,4\nB,1.7e308,3\nMean,-1.7e308,9\n",
        {},
        {"a": [1.6e308, 1.7e308, -1.7e308], "b": [4, 3, 9]},
    ),
    "a rounded sum of powers": ("m,a,b\nA,1.235e3,1e-6\nB,9.876e3,2e-6\nTotal,1.111e4,3e-6\n", {}, "'Total' and summarises"),
    "statistics alone": (",a,b\ncount,9,9\nmean,4,2.5\nstd,2,1\nmin,1,0.5\n25%,2,1\n50%,4,2\n75%,6,4\nmax,7,6\n", {}, "its rows count, mean, std, min and max are statistics of designs and no designs"),
    "powers beyond all numbers": (
        "a,b\n1,2\n2,3\n3,4\n1e-99999999999999999999,0e99999999999999999999\n",
        {},
        {"a": [1, 2, 3, 0], "b": [2, 3, 4, 0]},
    ),
    "a design without cost": ("m,a,b\nA,0,4\nB,0,3\nMax,0,2\n", {}, {"a": [0, 0, 0], "b": [4, 3, 2]}),
    # Titles, units, comments, headers
    "a title": (
        "Results of May\ncost;mass\n1,5;30\n2,25;2,5\n",
        {},
        "line 1 has 1 cell, the lines below 2; if it is a title, leave it out by --skip-rows 1",
    ),
    "a title left out": (
        "Results of May\ncost;mass\n1,5;30\n2,25;2,5\n",
        {"skip_rows": [1]},
        COST,
    ),
    "a title with empty cells": ("May,,\na,b,c\n1,2,3\n", {}, "header leaves .* --skip-rows 1"),
    "a line of units": (
        "cost;mass\n€;kg\n1,5;30\n2,25;2,5\n",
        {},
        r"row 1 \(line 2\) holds '€' in the column 'cost', text among numbers; .* --skip-rows 2",
    ),
    "title and units left out": (
        "Results\ncost;mass\n[€];[kg]\n1,5;30\n2,25;2,5\n",
        {"skip_rows": [1, 3]},
        COST,
    ),
    "comments": ("# from a tool\n# 2,5\ncost,mass\n1.5,30\n2.25,2.5\n", {}, COST),
    "names in a comment": ("# cost mass\n1.5e0 3e1\n2.25 2.5\n", {}, COST),
    "names in a comment, commas": ("#cost,mass\n1.5,30\n2.25,2.5\n", {}, COST),
    "a comment among designs": ("m,a,b\nA,1,2\n#B,2,1\nC,3,0\n", {}, "line 3 begins with #: a comment or a design; leave it out by --skip-rows 3"),
    "a comment at the end": ("a,b\n1,2\n# end\n", {}, "line 3 begins with #"),
    "designs with numbers": ("m,a,b\n#A,1,2\n#B,2,1\n", {}, {"a": [1, 2], "b": [2, 1]}),
    "a note at the end": ("a,b\n1,2\n3,4\nby M.\n", {}, r"row 3 \(line 4\) has 1 cell.* --skip-rows 4"),
    "no names": ("1.5,30\n2.25,2.5\n", {}, "its first line must name the columns, and holds num"),
    "no names, but one text": ("A,1.5,30\nB,2.25,2.5\n", {}, "must name the columns, and holds numbers, '1.5'"),
    "no names, and a comment": ("# made in May\nA,1.5,30\nB,2,2\n", {}, "must name the columns"),
    "numbers for names": (",0,1\n0,1.5,30\n1,2,3\n", {}, "must name the columns, and holds numbers, '0'"),
    "a name twice": ("a,b,a\n1,2,3\n", {}, "its header names the column 'a' 2 times"),
    "names, no rows": ("a,b\n", {}, "it holds column names, but no row"),
    "nothing": ("", {}, "it is empty"),
    "lines that are not there": ("a,b\n1,2\n", {"skip_rows": [3]}, "skip_rows must be numbers of lines of the file, 1 to 2, got 3"),
    # Blanks
    "a gap": (
        "a,b\n1,2\n3,\n",
        {},
        r"row 2 \(line 3\) holds no number in the column 'b'; leave out .* by --drop-incomplete",
    ),
    "words for a gap": ("a,b\n1,n/a\n3,4\n", {}, r"row 1 \(line 2\) holds no number .*--drop-incom"),
    "a dash for a gap": ("a,b\n1,—\n3,4\n", {}, r"row 1 \(line 2\) holds no number in .*--drop-incom"),
    "a spreadsheet's error": ("a,b\n1,#DIV/0!\n3,4\n", {}, "holds no number in .*--drop-incomplete"),
    "its error in German": ("a,b\n1,#WERT!\n3,4\n", {}, "holds no number in.*--drop-incomplete"),
    "a column too narrow": ("a,b\n1,####\n3,4\n", {}, "holds no number in .*--drop-incomplete"),
    "a formula": ("a,b,c\n1,2,=A2/B2\n3,4,=A3/B3\n", {}, "'=A2/B2' in the column 'c', a formula without its value; save"),
    "infinity": ("a,b\n1,inf\n3,4\n", {}, "holds inf in the column 'b'; .*--drop-incomplete"),
    "too large": ("a,b\n1,1e400\n3,4\n", {}, "holds 1e400 in the column 'b'; .*--drop-incomplete"),
    "incomplete rows left out": (
        "a,b\n1,2\n3,\n5,inf\n7,8\n",
        {"drop_incomplete": True},
        {"a": [1, 7], "b": [2, 8]},
    ),
    "nothing but gaps": ("a,b\n1,\n3,\n", {}, "its column 'b' holds no number at all"),
    "one objective": ("a,name\n1,x\n3,y\n", {}, "'a' is the only column that can be .*--objectives 'a'"),
    "one objective asked for": ("a,name\n1,x\n3,y\n", {"objectives": ["a"]}, {"a": [1, 3]}),
    # Encodings
    "a mark of UTF-8": ("\ufeffcost,mass\n1.5,30\n2.25,2.5\n", {}, COST),
    "UTF-16": ("cost;mass\n1,5;30\n2,25;2,5\n".encode("utf-16"), {}, COST),
    "UTF-16, big ends first": (
        b"\xfe\xff" + "cost;mass\n1,5;30\n2,25;2,5\n".encode("utf-16-be"),
        {},
        COST,
    ),
    "UTF-32": ("cost;mass\n1,5;30\n2,25;2,5\n".encode("utf-32"), {}, COST),
    "UTF-16 without a mark": ("a,b\n1,2\n".encode("utf-16-le"), {}, "null characters; .* --encoding utf-16"),
    "UTF-16 that is told": (
        "cost;mass\n1,5;30\n2,25;2,5\n".encode("utf-16-le"),
        {"encoding": "utf-16-le"},
        COST,
    ),
    "Windows": ("Größe;b\n1,5;3\n".encode("cp1252"), {}, "no UTF-8 text: .* --encoding cp1252"),
    "Windows that is told": (
        "Größe;b\n1,5 €;3\n".encode("cp1252"),
        {"encoding": "cp1252"},
        {"Größe": [1.5], "b": [3]},
    ),
    "an encoding nobody knows": ("a,b\n1,2\n", {"encoding": "cp99"}, "encoding must be one that"),
    "another encoding than is told": (
        "Größe;b\n1;3\n".encode("cp1252"),
        {"encoding": "utf-8"},
        "it is no text in utf-8",
    ),
    # Workbooks
    "a workbook": (workbook([["cost", "mass"], [1.5, 30], [2.25, 2.5]]), {}, COST),
    "texts in a workbook": (workbook([["cost", "mass"], ["1,5", 30], ["2,25", 2.5]]), {}, COST),
    "thousands in a workbook": (
        workbook([["a", "b"], ["1.250", 30], [980, 2.5]]),
        {},
        r"row 1 \(line 2\) holds '1.250' in the column 'a', either 1250 or 1.250",
    ),
    "a workbook with a title": (
        workbook([["Results", None], [None, None], ["cost", "mass"], [1.5, 30], [2.25, 2.5]]),
        {"skip_rows": [1]},
        COST,
    ),
    "a title in a workbook": (
        workbook([["Results", None, None], ["a", "b", "c"], [1.5, 30, 1]]),
        {},
        "leaves columns without a name; leave line 1 out by --skip-rows 1",
    ),
    "spaces below a workbook": (workbook([*TYPED, [" ", "\u00a0"]]), {}, COST),
    "a name over two lines of a workbook": (
        workbook([["cost\n[€]", "mass"], [1.5, 30], [2.25, 2.5]]),
        {},
        {"cost [€]": [1.5, 2.25], "mass": [30, 2.5]},
    ),
    "a gap in a workbook": (workbook([["a", "b"], [1, None], [2, 3]]), {}, r"row 1 \(line 2\) holds no number .* --drop-incomplete"),
    "a formula without value": (
        workbook([["m", "a", "b"], ["A", 1, 2], ["B", 3, "=B3+1"]]),
        {"drop_incomplete": True},
        "'=B3\\+1' in the column 'b', a formula without its value; save",
    ),
    "an error in a workbook": (workbook([["a", "b"], [1, "#DIV/0!"], [2, 3]]), {}, "holds no number .* --drop-incom"),
    "shares in per cent": (
        workbook([["a", "b"], [0.85, 2], [0.9, 1]], edit=in_per_cent("A2", "A3")),
        {},
        {"a": [0.85, 0.9], "b": [2, 1]},
    ),
    "shares beside per cents": (
        workbook([["a", "b"], [0.85, 2], [90, 1]], edit=in_per_cent("A2")),
        {},
        "holds 90 in the column 'a', in no unit, while .* is in per cent by its format",
    ),
    "shares beside per cents in text": (
        workbook([["a", "b"], [0.85, 2], ["90 %", 1]], edit=in_per_cent("A2")),
        {},
        "holds '90 %' in the column 'a', in %, while .* is in per cent by its format",
    ),
    "a stray cell far away": (
        workbook([["a", "b"], [1, 2]], edit=lambda sheet: sheet.cell(1000, 16384, "x")),
        {},
        "its cells reach from A1 to XFD1000, over four million; delete those beside the table",
    ),
    "a stray format far away on another sheet": (
        workbook([["a", "b"], [1, 2]], [], edit=lambda sheet: setattr(sheet.cell(1000, 16384), "number_format", "0%")),
        {"sheet": "S0"},
        {"a": [1], "b": [2]},
    ),
    "a sum in a workbook": (workbook([*TYPED, ["Total", 1], [3.75, 32.5]]), {}, "text among numbers"),
    "a workbook of two sheets": (workbook([["a"], [1]], [["b"], [2]]), {}, "2 sheets with cells: S0, S1"),
    "a sheet of two": (workbook([["a", "b"], [1, 2]], TYPED), {"sheet": "S1"}, COST),
    "no such sheet": (workbook([["a"], [1]], TYPED), {"sheet": "s1"}, "'S0', 'S1'.* did you mean 'S1'"),
    "a sheet of a text": ("a,b\n1,2\n", {"sheet": "S1"}, "sheet must be left out, as .* is no workbook"),
    "no workbook": (b"PK\x03\x04 and so on", {}, "it cannot be read as a workbook"),
    "a workbook of old": (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", {}, "workbook of old, or .* password; save it as .xlsx"),
    # Rankings as JSON
    "a name twice in JSON": (
        '{"objectives": ["a"], "maximized": [], "designs": [{"a": 1, "a": 2}]}',
        {},
        "it is JSON, but none that",
    ),
    "an objective twice in JSON": (
        '{"objectives": ["a", "a"], "maximized": [], "designs": [{"a": 1}]}',
        {},
        "its objectives are named twice; rank the designs anew",
    ),
    "half a character in JSON": (
        r'{"objectives": ["a\ud800"], "maximized": [], "designs": [{"a\ud800": 1}]}',
        {},
        "hold what no table can",
    ),
    "a list in JSON": (
        '{"objectives": ["a"], "maximized": [], "designs": [{"a": [1]}]}',
        {},
        "hold what no table can",
    ),
    "lines of JSON": (
        '{"objectives": ["a"], "maximized": [], "designs": [{"a": 1}]}',
        {"skip_rows": [1]},
        r"skip_rows must be left out, as .* is neither a text of designs nor a workbook, got \[1\]",
    ),
    "numbers in JSON": (
        '{"objectives": ["a", "b"], "maximized": ["b"], "designs": [{"a": 1, "b": 0.1}, {"a": 9007199254740993, "b": 1e-320}]}',
        {},
        {"a": [1.0, 9007199254740992.0], "b": [0.1, 1e-320]},
    ),
    "infinity in JSON": (
        '{"objectives": ["a"], "maximized": [], "designs": [{"a": 1e999}]}',
        {},
        "holds inf in the column 'a'",
    ),
}  # fmt: skip


def test_sums_without_a_name_are_told(path):
    """A sum of many designs by chance is rare in one column, of few it is not."""
    for rows, told in (
        ("1,4\n2,3\n4,2\n7,9\n", True),
        ("1,4\n2,3\n4,2\n7,8\n", False),
        ("1,4\n2,3\n3,7\n", False),
        ("0,4\n0,3\n0,2\n0,9\n", False),
        ("7,9\n1,4\n2,3\n4,2\n", False),
    ):
        path.write_text(f"a,b\n{rows}")
        file = read_designs(path)
        remark = "Row 4 (line 5) holds the sums of the rows above; if it is no design, leave it out"
        assert any(line.startswith(remark) for line in file.remarks) == told
        assert file.values(["a"])[-1] == float(rows.splitlines()[-1].partition(",")[0])


def test_what_a_sheet_hides_is_told(path, capsys):
    """By a filter, by hand or in a folded group: all of it is read unless it is left out."""

    def hide(sheet):
        sheet.auto_filter.ref = "A2:D6"
        for number in (4, 6, 20):
            sheet.row_dimensions[number].hidden = True
        sheet.column_dimensions.group("C", "D", hidden=True)

    rows = [["Results"], ["m", "a", "b", "c"], *([f"V{i}", i, 9 - i, 7] for i in range(1, 5))]
    path.write_bytes(workbook(rows, edit=hide))
    whole = read_designs(path, skip_rows=[1])
    assert whole.values(["a"]).ravel().tolist() == [1, 2, 3, 4]
    assert whole.remarks == (
        "Read although hidden in the sheet: 2 rows (line 4, 6); --skip-rows hidden leaves such rows "
        "out.",
        "Read although hidden in the sheet: 2 columns (b, c); --objectives says by which columns to "
        "rank.",
    )
    copied = pickle.loads(pickle.dumps(whole)).remarks  # as a worker gets it
    assert copied == whole.remarks
    assert [remark.fact for remark in copied] == [remark.fact for remark in whole.remarks]
    part = read_designs(path, skip_rows=["hidden", 1])
    assert part.values(["a"]).ravel().tolist() == [1, 3]
    assert part.lines == [3, 5]
    assert part.remarks == whole.remarks[1:]
    assert main(["rank", str(path), "--skip-rows", "1, hidden"]) == 0
    assert "2 designs" in capsys.readouterr().out
    path.write_text("a,b\n1,2\n")
    with pytest.raises(PsiError, match="skip_rows must be .*; only a workbook hides rows"):
        read_designs(path, skip_rows=["hidden"])
    with pytest.raises(PsiError, match="skip_rows must be"):
        read_designs(path, skip_rows=["visible"])


def test_the_saved_value_of_a_formula_is_read(path):
    """A formula without a value is told from one whose value is an empty text."""
    sheet = workbook([["a", "b"], [1, "=A2+1"], [2, "=A3+1"], [3, '=""']])
    with zipfile.ZipFile(io.BytesIO(sheet)) as book, zipfile.ZipFile(path, "w") as saved:
        for part in book.namelist():
            text = book.read(part)
            if part.endswith("sheet1.xml"):
                for value in (b"<v>2.5</v>", b"<v>" + b"9" * 400 + b"</v>"):  # beyond float64
                    text = re.sub(b"<v ?/>|<v></v>", value, text, count=1)
                text = text.replace(b'<c r="B4"', b'<c r="B4" t="str"')
            saved.writestr(part, text)
    file = read_designs(path)
    np.testing.assert_array_equal(file.numbers("b"), [2.5, np.inf, np.nan])


@pytest.mark.parametrize("name", FILES)
def test_a_file_is_read_right_or_refused(tmp_path, name):
    content, options, expected = FILES[name]
    path = tmp_path / "designs"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    options = dict(options)
    objectives, drop = options.pop("objectives", None), options.pop("drop_incomplete", False)

    def values():
        file = read_designs(path, **options)
        roles = file.roles(objectives)
        file = file.complete(roles.objectives) if drop else file
        return dict(zip(roles.objectives, file.values(roles.objectives).T.tolist(), strict=True))

    if isinstance(expected, str):
        with pytest.raises(PsiError, match=expected):
            values()
    else:
        assert values() == expected


def test_there_are_enough_habits():
    assert len(FILES) >= 80


# Numbers in the habit of a country, and what must come of them: themselves or a refusal.
DIVIDERS = {".": [",", ";", "\t", "|"], ",": [";", "\t", "|"]}
THOUSANDS = {".": ["", ",", " ", "'", "\u202f"], ",": ["", ".", " ", "\u00a0"]}


@st.composite
def habits(draw):
    """The text of a file, the numbers in it by column, and the encoding it is written in."""
    decimal = draw(st.sampled_from(".,"))
    divider, thousands = (
        draw(st.sampled_from(DIVIDERS[decimal])),
        draw(st.sampled_from(THOUSANDS[decimal])),
    )
    n, m = draw(st.integers(1, 6)), draw(st.integers(2, 4))
    minus, quoted = draw(st.sampled_from("-−")), draw(st.booleans())
    columns, texts = {}, []
    for j in range(m):
        before, after = draw(
            st.sampled_from([("", ""), ("$", ""), ("", "%"), ("", " kg"), ("€ ", "")])
        )
        digits = draw(st.integers(0, 4))
        values, cells = [], []
        for _ in range(n):
            whole, fraction = draw(st.integers(0, 10**7)), draw(st.integers(0, 10**digits - 1))
            sign = draw(st.sampled_from(["", minus]))
            grouped = f"{whole:,}".replace(",", thousands) if thousands else str(whole)
            tail = f"{fraction:0{digits}d}" if digits else ""
            values.append(float(f"{'-' if sign else ''}{whole}.{tail or 0}"))
            cell = f"{sign}{before}{grouped}{decimal if tail else ''}{tail}{after}"
            cells.append(f'"{cell}"' if quoted or divider in cell else cell)
        columns[f"c{j}"] = values
        texts.append(cells)
    lines = [divider.join(columns), *(divider.join(row) for row in zip(*texts, strict=True))]
    end = draw(st.sampled_from(["\n", "\r\n"]))
    title = draw(st.sampled_from(["", f"# made in May{end}", f"sep={divider}{end}"]))
    encoding = draw(st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "cp1252"]))
    return title + end.join(lines) + end, columns, encoding, decimal


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return tmp_path_factory.mktemp("habits") / "designs.csv"


def check(path, columns, **options):
    """Read a file: what comes is what was written, or it is refused as a user can understand."""
    try:
        file = read_designs(path, **options)
        roles = file.roles()
        F = file.values(roles.objectives)
    except PsiError:
        return False
    assert list(roles.objectives) == list(columns)
    np.testing.assert_array_equal(F, np.column_stack(list(columns.values())))
    # What is written out again says the same to any program.
    for name, cells in file.cells[list(columns)].items():
        assert [float(cell) for cell in cells] == columns[name]
    return True


@settings(max_examples=75)
@given(habit=habits())
def test_what_is_read_is_what_was_written(path, habit):
    text, columns, encoding, _ = habit
    path.write_bytes(text.encode(encoding, "replace"))
    check(path, columns)


@settings(max_examples=75)
@given(habit=habits())
def test_with_mark_and_encoding_told_every_such_file_is_read(path, habit):
    text, columns, encoding, decimal = habit
    text = text.replace("−", "-").replace("\u202f", " ")  # which not every encoding has
    path.write_bytes(text.encode(encoding))
    assert check(path, columns, decimal=decimal, encoding=encoding)


@settings(max_examples=75)
@given(
    text=st.one_of(
        st.binary(max_size=200),
        st.text("ab01,.;\t|\"'# -%€\n\r{}[]:", max_size=200).map(str.encode),
        st.text(max_size=100).map(lambda text: text.encode("utf-16", "surrogatepass")),
    ),
    decimal=st.sampled_from([None, ".", ","]),
)
def test_whatever_a_file_holds_the_answer_is_numbers_or_a_message(path, text, decimal):
    path.write_bytes(text)
    try:
        file = read_designs(path, decimal=decimal)
        F = file.values(file.roles().objectives)
    except PsiError:
        pass
    else:
        assert F.shape == (len(file), F.shape[1])
        assert np.isfinite(F).all()


@settings(max_examples=100)
@given(
    cells=st.lists(
        st.lists(st.text("0123456789.,-+eE $%'", min_size=1, max_size=8), min_size=2, max_size=2),
        min_size=1,
        max_size=4,
    )
)
@example([["0", "12.-"]])
def test_a_number_that_programs_read_is_read_the_same(path, cells):
    """Whatever looks like Python's numbers is not taken for others, but may be refused."""
    path.write_text("a\tb\n" + "".join("\t".join(row) + "\n" for row in cells))
    try:
        F = read_designs(path, decimal=".").values(["a", "b"])
    except PsiError:
        return
    for row, values in zip((row for row in cells if "".join(row).strip()), F, strict=True):
        for cell, value in zip(row, values, strict=True):
            try:
                assert float(cell) == value
            except ValueError:
                bare = cell.translate({ord(c): None for c in " $%',"}).replace("+-", "-")
                assert float(re.sub(r"(?<=\.)--?$", "", bare)) == value  # 12.- is a price


@pytest.mark.parametrize(
    "cell", ["1" * 100_000 + "x", "$" * 100_000, "1.1" * 30_000, "1," * 50_000]
)
def test_long_cells_take_no_time(path, cell):
    path.write_text(f'a,b\n1,"{cell}"\n', encoding="utf-8")
    with pytest.raises(PsiError):
        read_designs(path).values(["b"])


# What is read is read once


def test_a_pipe_is_read_to_its_end(tmp_path, capsys):
    """A pipe cannot be opened twice; 300 designs are more than a buffer of 4096 bytes holds."""
    pipe, out = tmp_path / "pipe", tmp_path / "out.csv"
    os.mkfifo(pipe)
    text = "cost,mass\n" + "".join(f"{i / 7},{(300 - i) / 3}\n" for i in range(300))
    writer = threading.Thread(target=lambda: pipe.write_text(text))
    writer.start()
    code = main(["rank", str(pipe), "--out", str(out)])
    writer.join()
    assert code == 0
    assert "300 designs, 300 Pareto optimal" in capsys.readouterr().out
    frame = pd.read_csv(out)
    assert sorted(frame["row"]) == list(range(1, 301))


# The options of the commands


def test_the_options_of_rank(tmp_path, capsys):
    path, out = tmp_path / "d.csv", tmp_path / "out.csv"
    path.write_bytes("Größen\nGröße;Preis\ncm;€\n2,5;1.250\n3,5;980\n4;\n".encode("cp1252"))
    options = ["--encoding", "cp1252", "--skip-rows", "1,3", "--drop-incomplete"]
    assert main(["rank", str(path), *options]) == 2
    error = capsys.readouterr().err
    assert "row 1 (line 4) holds '1.250' in the column 'Preis', either 1250 or 1.250" in error
    for mark in (["--decimal", ","], ["--thousands", "."]):
        assert main(["rank", str(path), *options, *mark, "--out", str(out)]) == 0
        printed = capsys.readouterr().out
        assert "1 incomplete design left out: row 3." in printed
        assert "2 designs, 2 Pareto optimal" in printed
        frame = pd.read_csv(out).sort_values("row")
        assert frame["Größe"].tolist() == [2.5, 3.5]
        assert frame["Preis"].tolist() == [1250, 980]
    for wrong in (
        ["--decimal", ":"],
        ["--thousands", "x"],
        ["--skip-rows", "one"],
        ["--skip-rows", "0"],
    ):
        assert main(["rank", str(path), *wrong]) == 2
        assert wrong[0].strip("-").replace("-", "") in capsys.readouterr().err.replace(
            "_", ""
        ).replace("-", "")


def test_the_options_of_the_page(tmp_path, capsys):
    path, old, out = tmp_path / "d.csv", tmp_path / "old.csv", tmp_path / "page.html"
    path.write_text("Results\nmass;price\n2,5 kg;1.250\n3,5 kg;980\n4 kg;\n", encoding="utf-8")
    old.write_text("name;mass;price\nold;3,5;1.200\n", encoding="utf-8")
    options = ["--skip-rows", "1", "--drop-incomplete", "--prototype", str(old), "--out", str(out)]
    assert main(["page", str(path), *options]) == 2
    assert "holds '1.250' in the column 'price'" in capsys.readouterr().err
    assert main(["page", str(path), *options, "--decimal", ","]) == 0
    printed = capsys.readouterr().out
    assert "Objectives: mass (in kg), price" in printed
    assert "2 designs by mass, price" in printed


def test_a_code_keeps_its_zeros_in_json(tmp_path):
    path, out = tmp_path / "d.csv", tmp_path / "out.json"
    path.write_text("id,a,b,steel\n007,1,2,1.4301a\n010,2,1,1.4301b\n")
    assert main(["rank", str(path), "--objectives", "a,b", "--out", str(out)]) == 0
    designs = {row["id"]: row for row in json.loads(out.read_text("utf-8"))["designs"]}
    assert designs["007"]["steel"] == "1.4301a"
    assert designs["010"]["a"] == 2


def test_a_number_that_is_not_certain_stays_text_in_json(tmp_path):
    """1.250 may be 1250; a column that is not an objective is passed on as it is written."""
    path, out = tmp_path / "d.csv", tmp_path / "out.json"
    path.write_text("a;b;c\n1;2;1.250\n2;1;980\n")
    assert main(["rank", str(path), "--objectives", "a,b", "--out", str(out)]) == 0
    designs = json.loads(out.read_text("utf-8"))["designs"]
    assert sorted(row["c"] for row in designs) == ["1.250", "980"]
