"""Sources of every kind: read right to the last digit, or refused with what settles it."""

import io
import os
import pickle
import re
import threading
from contextlib import suppress
from decimal import Decimal

import numpy as np
import openpyxl
import pandas as pd
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.population import Population
from pymoo.core.result import Result
from pymoo.optimize import minimize

from pymoo_psi import (
    Formulation,
    PsiError,
    TestTable,
    VectorizedSphereChute,
    explain,
    investigate,
)
from pymoo_psi.files import read_table, write_table
from tests.helpers.draws import examples
from tests.helpers.models import Model
from tests.helpers.refusals import refused
from tests.helpers.studies import sql

COST = {"cost": [1.5, 2.25], "mass": [30.0, 2.5]}
TYPED = [["cost", "mass"], [1.5, 30], [2.25, 2.5]]


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


def in_per_cent(sheet):
    for row in (2, 4):
        sheet.cell(row, 2).number_format = "0.0%"


def saved(save, **arrays):
    """What a function of NumPy writes."""
    stream = io.BytesIO()
    save(stream, **arrays)
    return stream.getvalue()


STATUS = "run,status,mass,cost\n1,ok,5,3\n2,failed,0,0\n3,ok,4,4\n4,timeout,0,\n"
RANKED = (
    "test,x1,x2,f1,f2,g1,mu1,mu2,rank,pareto\n4,2,0.5,4,5,6,7,8,6,True\n9,3,0.5,4,5,6,7,8,6,True\n"
)
EXPORT = (
    "place,number,f1,f2,mark\n,old,9,9,prototype\n"
    "1,5,1,2,place 1\n2,7,2,1,place 2\n,8,3,3,dominated\n"
)
WIDE = [f"c{j}" for j in range(2_000)]

# What a file holds, the options given, and what must come of it: the numbers of each objective in
# their order, or the message.
FILES = {
    # Separators
    "commas": ("cost,mass\n1.5,30\n2.25,2.5\n", {}, COST),
    "semicolons, decimal commas": ("cost;mass\n1,5;30\n2,25;2,5\n", {}, COST),
    "columns of spaces": ("  cost   mass\n   1.5     30\n  2.25    2.5\n", {}, COST),
    "a separator that is stated": ("sep=;\ncost;mass\n1,5;30\n2,25;2,5\n", {}, COST),
    "another one, and a line to leave out": ('Offers\r\n"sep=\t"\r\ncost\tmass\r\n1.5\t30\r\n2.25\t2.5\r\n', {"skip_rows": [1]}, COST),
    "a name with a comma": ("t, s;mass\n1,5;2,5\n2;3\n", {}, {"t, s": [1.5, 2], "mass": [2.5, 3]}),
    "a name over two lines": ('"cost\nin €",mass\n1.5,30\n2,2\n', {}, {"cost in €": [1.5, 2], "mass": [30, 2]}),
    "a short row": ("a,b\n1,2\n3\n", {}, "line 3 has 1 cell, most lines 2"),
    # Points and commas
    "decimals and thousands in a column": ("a;b\n2,5;1\n1.250;2\n", {}, {"a": [2.5, 1250], "b": [1, 2]}),
    "thousands beside decimal commas": ("cost;mass\n2,5;1.250\n3,5;980\n", {}, r"row 1 \(line 2\) holds '1\.250' in the column 'mass', either 1250 or 1\.25; state the decimal mark by read_table\(\.\.\., decimal=','\) or read_table\(.*, decimal='\.'\)"),
    "the same with the decimal mark": ("cost;mass\n2,5;1.250\n3,5;980\n", {"decimal": ","}, {"cost": [2.5, 3.5], "mass": [1250, 980]}),
    "the same with commas between cells": ('cost,mass\n"2,5",1.250\n"3,5",2.980\n', {}, "'1.250' in the column 'mass', either 1250 or 1.25; state the"),
    "decimal commas, one in front of three digits": ("cost;mass\n2,5;1,250\n3,5;980\n", {}, {"cost": [2.5, 3.5], "mass": [1.25, 980]}),
    "columns of both notations": ("a;b;c\n2,5;1.5;1.250\n3,5;2.5;2.980\n", {}, "'1.250' in the column 'c', either 1250 or 1.25; state the"),
    "labels with a point": ("id;a;b\n1.2;1.250;3\n1.3;2.980;4\n", {}, "'1.250' in the column 'a', either 1250 or 1.25; state the"),
    "labels with a comma": ('id,a,b\n"1,2",1.250,3\n"1,3",2.980,4\n', {}, {"a": [1.25, 2.98], "b": [3, 4]}),
    "three decimals or thousands, commas": ("a,b\n1.250,3\n980,4\n", {}, "'1.250' .* state the decimal"),
    "three decimals as programs print them": ("a,b\n1.250,3\n0.980,4\n2.500,5\n", {}, {"a": [1.25, 0.98, 2.5], "b": [3, 4, 5]}),
    "three decimals, none below one": ("a,b\n1.250,3\n2.980,4\n", {}, {"a": [1.25, 2.98], "b": [3, 4]}),
    "three decimals, told by a leading zero": ("a;b\n0.125;3\n1.250;4\n", {}, {"a": [0.125, 1.25], "b": [3, 4]}),
    "a comma in front of three digits": ('a,b\n"1,250",3\n980,4\n', {}, "either 1250 or 1.25; state the decimal mark by .*decimal='.'\\) or .*dec"),
    "a decimal point in a column of commas": ("a;b\n1.5;2\n1,5;2\n", {}, r"row 2 \(line 3\) holds '1,5' in the column 'a', no plain number"),
    "spaces between thousands": ("a;b\n1 250;1\n2 500,5;2\n", {}, {"a": [1250, 2500.5], "b": [1, 2]}),
    # Signs, units, what is no plain number
    "per cent": ("a,b\n85%,30\n90.5 %,2\n", {}, {"a": [85, 90.5], "b": [30, 2]}),
    "per cent, decimal commas": ("a;b\n81,5 %;30\n79,25\u00a0%;2\n;3\n", {"drop_incomplete": True}, {"a": [81.5, 79.25], "b": [30, 2]}),
    "per cent beside plain numbers": ("a,b\n85%,30\n0.9,2\n", {}, "'85%' in the column 'a', no plain number; write it without a unit"),
    # Fortran
    "Fortran": ("f1,f2\n1D+03,2.5d0\n3D-02,.5D1\n-0.2D+03,0.12+103\n0.5-101,1\n", {}, {"f1": [1000, 0.03, -200, 0.5e-101], "f2": [2.5, 5, 0.12e103, 1]}),
    "Fortran without a header": ("0.12+103,0.5D+02\n0.1+103,0.6D+02\n", {}, "must name the columns, and holds numbers"),
    "Fortran, decimal commas": ("f1;f2\n1,5D+03;2\n-2,25D-01;1\n", {}, {"f1": [1500, -0.225], "f2": [2, 1]}),
    "dimensions are no numbers": ("m,a,b\n1D,1,2\n2D2,2,1\n", {"objectives": ["a", "b"]}, {"a": [1, 2], "b": [2, 1]}),
    "ranges are no numbers": ("m,a,b\n1.5-200,1,2\n2-300,2,1\n", {}, "'1.5-200' in the column 'm', no plain number"),
    # Names in a comment: numpy.savetxt, MATLAB
    "names in a comment": ("# f1,f2\n1,2\n2,1\n", {}, {"f1": [1, 2], "f2": [2, 1]}),
    "names in a comment, titles": ("# of May\n#\n#f1,f2\n1,2\n2,1\n# the end\n", {}, {"f1": [1, 2], "f2": [2, 1]}),
    "names in a comment, blanks": ("% f1, f2\n1.0e+00 2.0e+00\n2.0e+00 1.5e-07\n", {}, {"f1": [1, 2], "f2": [2, 1.5e-7]}),
    "names and units in comments": ("# f1 f2\n# kg mm\n1 2\n2 1\n", {}, "comments in lines 1,2 may all be the names .* skip_rows"),
    "units of comments left out": ("# f1 f2\n# kg mm\n1 2\n2 1\n", {"skip_rows": [2]}, {"f1": [1, 2], "f2": [2, 1]}),
    "a comment with too few names": ("# f1 f2\n1 2 3\n2 1 3\n", {}, "must name the columns, and holds numbers"),
    # Aligned cells: SU2, Dakota
    "padded quotes": ('"Iter" ,    "CD"     ,"CL" \n  0,   0.34,  0.5\n  1,   0.32,  0.6\n', {"objectives": ["CD", "CL"]}, {"CD": [0.34, 0.32], "CL": [0.5, 0.6]}),
    "padded quotes with commas in them": ('name ;"C;D"  ; b\n"A; x"  ;1;2\n"B, y" ;2;1\n', {}, {"C;D": [1, 2], "b": [2, 1]}),
    "a quotation mark within a cell": ('name,a,b\n"A" x,1,2\nB,2,1\n', {}, "no text in rows and columns"),
    "Dakota": ("%eval_id interface x1       f1    f2\n1   NO_ID  3.5   1402.3 0.19\n2   NO_ID  4.5   1202.3 0.29\n", {"objectives": ["f1", "f2"]}, {"f1": [1402.3, 1202.3], "f2": [0.19, 0.29]}),
    "Dakota without a comment": ("eval_id interface   x1  f\n1 NO_ID  3.5   1402.3\n2 NO_ID  4.5   1202.3\n", {"objectives": ["f"]}, {"f": [1402.3, 1202.3]}),
    "dates are text": ("day;a;b\n01.05.2024;1,5;2\n2024-05-02;2,5;3\n", {}, {"a": [1.5, 2.5], "b": [2, 3]}),
    "text beside numbers": ("a,b\n1,2\noak,3\n", {}, r"row 2 \(line 3\) holds 'oak' in the column 'a', no plain number; .* skip_rows=.3"),
    **{
        text: (f"a,b,c\n1,3,{text}\n2,4,{text}\n", {}, f"{re.escape(text)}' in the column 'c', no plain number")
        for text in ("$2.50", "2.5 €", "SEK 5200", "kr 5", "R$ 5", "EUR 3", "EUR500", "HK$5", "Rp 500", "12 kg", "7°C", "304L", "~5", "<5", "5-6", "1/2", "0x1F", "1.2.3", "=A2/B2", "1_000", "(1.5)", "5 minutes")
    },
    "numbers of one unit": ("a,b,c\n1,3,10k Euro\n2,4,20k Euro\n", {}, "no plain number"),
    # A last row that is the sum of all others
    "a sum": ("m;a;b\nA;1;4\nB;2;3\nC;4;2\nSumme:;7;9\n", {}, r"row 4 \(line 5\) is named 'Summe:', as computed from others; leave it out by .* skip_rows=.5.., or rename it"),
    "a sum of two": ("m,a,b\nA,1,4\nB,2,3\n TOTAL ,3,7\n", {}, "line 4. is named 'TOTAL', as computed from others"),
    "a mean": ("m,a,b\nA,10,60\nB,14,52\nC,20,40\nAverage,14.67,50.67\n", {}, r"row 4 \(line 5\) is named 'Average', as computed from others; leave"),
    "a sum beside a column of zeros": ("m,a,b,c\nA,1,4,0\nB,2,3,0\nC,4,2,0\nD,7,9,0\n", {}, r"row 4 \(line 5\) is the sum of all others"),
    "a design with a zero below a sum": ("m,a,b\nA,1,4\nB,2,3\nC,4,2\nD,7,0\n", {}, {"a": [1, 2, 4, 7], "b": [4, 3, 2, 0]}),
    "a design in the middle": ("m,a,b\nA,1,60\nB,2,30\nC,3,0\nD,2,30\n", {}, {"a": [1, 2, 3, 2], "b": [60, 30, 0, 30]}),
    "a mean above all": ("m,a,b\nMean,12.3,56.1\nA,10.1,60.3\nB,14.2,52.1\nC,12.5,55.8\n", {}, r"row 1 \(line 2\) is named 'Mean', as computed from others"),
    "greatest values": ("m,a,b\nA,10,60\nB,14,52\nMax,14,60\n", {}, "is named 'Max', as computed from others"),
    "an ideal above all": ("m,a,b\nIdeal,9,70\nA,10,60\nB,14,52\n", {}, r"row 1 \(line 2\) is named 'Ideal', as values asked for; leave it out by .* skip_rows=.2"),
    "limits below all": ("m,a,b\nA,10,60\nB,14,52\nGrenzwert:,9,70\n", {}, "is named 'Grenzwert:', as values asked for"),
    "a target between designs": ("m,a,b\nA,10,60\nTarget,9,70\nB,14,52\n", {}, {"a": [10, 9, 14], "b": [60, 70, 52]}),
    "levels of a factor": ("fan,a,b\nmin,1,5\nmax,1,3\nauto,2,3\nmin,2,3\nmax,2,5\n", {}, {"a": [1, 1, 2, 2, 2], "b": [5, 3, 3, 3, 5]}),
    "a gap beside objectives that are named": ("x1,f1,f2,f3\n1,2,3,\n2,1,5,1\n", {"objectives": ["f1", "f2"]}, {"f1": [2, 1], "f2": [3, 5]}),
    "a design called Standard": ("m,a,b\nStandard,10,60\nMax,14,65\nPro,20,50\n", {}, {"a": [10, 14, 20], "b": [60, 65, 50]}),
    "a sum under names that recur": ("maker,a,b\nA,1,4\nA,2,3\nGrand total,3,\n", {}, "named 'Grand total'"),
    "sums between designs": ("no,m,a,b\n1,A,1,4\n2,A,2,3\n3,Zwischensumme,3,7\n4,A,4,2\n", {}, "named 'Zwischensumme'"),
    "a second sum between designs": ("m,part,size,a,b\nG,A,3,1,4\nH,B,2,2,3\nH,C,2,5,3\nH,Subtotal,,7,6\nK,D,1,4,2\n", {"objectives": ["a", "b"]}, r"row 4 \(line 5\) is named 'Subtotal'"),
    "a name that begins like a sum": ("m,a,b\nTotal SE,1,4\nSummit,2,3\n", {}, {"a": [1, 2], "b": [4, 3]}),
    "texts like a sum": ("m,kind,a,b\nA,total,1,4\nB,sum,2,3\n", {}, {"a": [1, 2], "b": [4, 3]}),
    "a design that is the sum of others": ("m,a,b\nA,1,1\nB,1,1\nC,1,1\nBig,3,3\n", {}, "is the sum of all others; leave it out by .* skip_rows=.5.., or put it above another row"),
    "a design that is the sum of others, above one": ("m,a,b\nA,1,1\nB,1,1\nBig,3,3\nC,1,1\n", {}, {"a": [1, 1, 3, 1], "b": [1, 1, 3, 1]}),
    "a sum left out": ("m;a;b\nA;1;4\nB;2;3\nC;4;2\nSumme:;7;9\n", {"skip_rows": [5]}, {"a": [1, 2, 4], "b": [4, 3, 2]}),
    "a sum without any names": ("a,b\n1,4\n2,3\n4,2\n7,9\n", {}, "line 5. is the sum of all others;"),
    "a sum of deviations": ("mass,cost,dev\n1,2,.3\n2,1,-.1\n3,1,-.2\n6,4,0\n", {}, r"row 4 \(line 5\) is the sum of all others"),
    "a sum of two without a name": ("m,a,b\nA,1,4\nB,2,3\n,3,7\n", {}, "line 4. is the sum of all others"),
    "texts beside a number name nothing": ("id,supplier,a,b\n1,Shell,3,4\n2,Total,2,5\n3,BP,4,1\n", {}, {"a": [3, 2, 4], "b": [4, 5, 1]}),
    "texts that recur name nothing": ("a,b,view\n1,4,total\n2,3,partial\n3,2,total\n", {}, {"a": [1, 2, 3], "b": [4, 3, 2]}),
    "a remark that is missing": ("a,b,remark\n1,2,ok\n2,3,ok\n3,5,\n", {}, {"a": [1, 2, 3], "b": [2, 3, 5]}),
    "a sum of two without a number": ("nr,a,b\n1,1,4\n2,2,3\n,3,7\n", {}, "line 4. is the sum of all others"),
    "no sum of two": ("a,b\n1,4\n2,3\n3,7\n", {}, {"a": [1, 2, 3], "b": [4, 3, 7]}),
    "no sum without any names": ("a,b\n1,4\n2,3\n4,2\n7,8\n", {}, {"a": [1, 2, 4, 7], "b": [4, 3, 2, 8]}),
    # Titles, units, comments, headers
    "a comment among designs": ("m,a,b\nA,1,2\n# mended,,\nC,3,0\n", {}, {"a": [1, 3], "b": [2, 0]}),
    "a comment or a design": ("m,a,b\nA,1,2\n#B,2,1\nC,3,0\n", {}, "line 3 begins with # .* skip_rows=.3.. if"),
    "many blank lines": ("\n" * 10**5 + "cost,mass\n1.5,30\n2.25,2.5\n", {}, COST),
    "two thousand columns": (f"{','.join(WIDE)}\n{'1,' * 1999}1\n{'2,' * 1999}2\n", {"objectives": ["c7"]}, {"c7": [1, 2]}),
    "as many names as cells": ("unit cost   mass\nA  1.5  30\n", {}, {"cost": [1.5], "mass": [30]}),
    "a title": ("Offers 2026,,\nname,price,power\nA,1,5\nB,2,7\n", {}, "names? (is|are) empty .* skip_rows=.1"),
    "a title of two columns": ("Offers 2026,\nprice,power\n1,5\n2,7\n", {}, "names? (is|are) empty .* skip_rows=.1"),
    "a title without separators": ("Offers 2026\nname;price;power\nA;1;5\nB;2;7\n", {}, "line 1 has 1 cell, most lines 3; .* skip_rows=.1"),
    "a title left out": ("Offers 2026,,\nname,price,power\nA,1,5\nB,2,7\n", {"skip_rows": [1]}, {"price": [1, 2], "power": [5, 7]}),
    "a title of a workbook": (workbook([["Offers"], [], *TYPED]), {}, "names? (is|are) empty .* skip_rows=.1"),
    "one line, not a list": ("a,b\n1,2\n", {"skip_rows": 2}, "skip_rows must be a list of numbers of lines, got 2"),
    "a text of variables": ("b,c,d\n1,2,3\n2,1,4\n", {"variables": "bc"}, "variables must be a list of names, got 'bc'"),
    "a line that is not there": ("a,b\n1,2\n", {"skip_rows": [99]}, "lines of the file, 1 to 2, got 99"),
    "a result as label": ("rank,a,b\n1,1,2\n1,3,1\n2,2,2\n", {"average_by": "rank"}, {"a": [2, 2], "b": [1.5, 2]}),
    "equal rows as repeats": ("name,a,b\nA,1,4\nA,1,4\nA,4,4\nB,3,2\n", {"average_by": "name"}, {"a": [2, 3], "b": [4, 2]}),
    "names under test": ("test,a,b\nA,1,2\nB,2,1\n", {}, "must number the designs"),
    # Blanks
    "a gap that a limit leaves out": ("a,b,stock\n1,2,1\n3,,0\n7,8,2\n", {"objectives": ["a", "b"], "limits": "stock>=1"}, {"a": [1, 7], "b": [2, 8]}),
    "a gap": ("a,b\n1,2\n3,\n", {}, r"row 2 \(line 3\) holds no number in the column 'b'; leave out .* by .* drop_incomplete=True"),
    "incomplete rows left out": ("a,b\n1,2\n3,\n5,inf\n7,8\n", {"drop_incomplete": True}, {"a": [1, 7], "b": [2, 8]}),
    # Encodings
    "Windows": ("Größe;b\n1,5;3\n".encode("cp1252"), {}, "it is no text: .* encoding='cp1252'"),
    "UTF-16 without a mark": ("cost,mass\n1,5\n3,4\n".encode("utf-16-le"), {}, "it holds zero bytes, as UTF-16 does; give its encoding"),
    "UTF-16 that is named": ("cost,mass\n1.5,30\n2.25,2.5\n".encode("utf-16-le"), {"encoding": "utf-16-le"}, COST),
    # Workbooks
    "a sheet of a text": ("cost,mass\n1,5\n3,4\n", {"sheet": "S1"}, "sheet must be left out for a text"),
    "a workbook": (workbook(TYPED), {}, COST),
    "a word for nothing": ("a,b\n1,2\nk. A.,3\n4,1\n", {"drop_incomplete": True}, {"a": [1, 4], "b": [2, 1]}),
    "a stray cell far away": (workbook([["a", "b"], [1, 2]], edit=lambda sheet: sheet.cell(50, 2048, "x")), {}, "empty in its first line"),
    "a range of ten million merged cells": (workbook(TYPED, edit=lambda sheet: sheet.merged_cells.add("D1:M1048576")), {}, COST),
    "a workbook of two sheets": (workbook([["a"], [1]], [["b"], [2]]), {}, "2 sheets: S0, S1"),
    "a sheet of two": (workbook([["a", "b"], [1, 2]], TYPED), {"sheet": "S1"}, COST),
    # What else a file may be
    "an array of NumPy": (b"\x93NUMPY\x01\x00v\x00", {}, r"an array of NumPy .* numpy.savetxt\('designs.csv', numpy.load\('designs'\)"),
    "an archive of NumPy": (saved(np.savez, F=np.ones((2, 2))), {}, "an archive of NumPy"),
    "Parquet that pandas cannot read": (b"PAR1" + bytes(20), {}, "it is Parquet, .*read_parquet|could not"),
    "a pickle": (pickle.dumps([1]), {}, "a pickle of Python"),
    "HDF5": (b"\x89HDF\r\n\x1a\n", {}, "HDF5, .*read_hdf"),
    "a key of JSON twice": ('[{"a": 1, "b": 2, "a": 3}, {"a": 2, "b": 1}]', {}, "distinct, got 'a' twice"),
    "JSON Lines": ('{"a": 1, "b": 2}\n{"a": 2, "b": 1}\n', {}, "JSON Lines.*lines=True"),
    # Texts
    "blanks around texts": ("rail,a,b\nyes,1,3\nyes ,2,2\nno,3,1\n", {"limits": "rail=yes"}, {"a": [1, 2], "b": [3, 2]}),
    **{
        "; ".join(rows): ("\n".join(["process,cost,mass", *rows]), {}, {"cost": [1, 3, 2][:len(rows)], "mass": [2, 1, 2][:len(rows)]})
        for rows in (
            ["3D printing,1,2", "2K moulding,3,1", "casting,2,2"],
            ["3D printing,1,2", "3D milling,3,1", "5-axis milling,2,2"],
            ["3D printing,1,2", "3D printing,3,1"],
            ["INR18650,1,2", "RS485,3,1"],
            ["RP-1,1,2", "EUR1,3,1", "ILS 1,2,2"],
            ["2-part,1,2", "0815-B,3,1", "3D\u2011printed,2,2"],
            ["1.1.2024,1,2", "2.1.2024,3,1"],
        )
    },
    # What is asked for
    "failures left out by a limit": (STATUS, {"objectives": ["mass", "cost"], "limits": "status=ok"}, {"mass": [5, 4], "cost": [3, 4]}),
    "a gap under a limit": ("a,b\n1,2\n3,\n4,1\n", {"objectives": ["a", "b"], "limits": "b<=5"}, "row 2 .* holds no number in the column 'b'"),
    "a mean at its limit": ("m,a,b\nA,0.1,5\nA,0.2,5\nA,0.3,5\nB,0.15,7\n", {"average_by": "m", "limits": "a<=0.2"}, {"a": [0.2, 0.15], "b": [5, 7]}),
    "a failure without a number": (STATUS, {"objectives": ["cost"]}, "row 4 .* holds no number in the column 'cost'"),
    "one column of numbers": (RANKED, {"variables": ["f2"]}, "two columns or more must be of numbers, .* got f1; to rank"),
    "names and one column of numbers": ("a,b\nx,1\ny,2\n", {}, "01067, got b; to rank"),
    "texts alone": ("a,b\nx,u\ny,v\n", {}, "01067, got none; to rank"),
    "variables alone": ("x1,x2,x3\n1,2,3\n2,3,1\n", {}, r"without labels, variables and codes such as 01067, got none; to rank .*, name them by Formulation"),
    "an objective that is not there": (RANKED, {"objectives": ["f3"]}, "objectives must be one of"),
    "lines of JSON": ('[{"a": 1, "b": 2}]', {"skip_rows": [1]}, "must be left out for JSON"),
    "results alone": ("status,violated,reason,pareto\nok,,,True\n", {"objectives": ["f1"]}, "objectives must be one of no names"),
    "no list of designs": ('{"a": 1}', {}, "no list of designs"),
    "a list of designs and a number": ('[{"a": 1}, 2]', {}, "no list of designs"),
    "a list without an end": ('[{"a": 1', {}, "no list of designs"),
    "numbers called design that are named": ("car,price,design\nA,1,7\nB,2,9\nC,3,9\n", {"objectives": ["price", "design"]}, {"price": [1, 2, 3], "design": [7, 9, 9]}),
    "numbers called design that are maximised": ("car,price,design\nA,1,7\nB,2,9\nC,3,9\n", {"maximize": ["design"]}, {"price": [1, 2, 3], "design": [7, 9, 9]}),
    "equal rows count once": ("name,cost,mass\nA,1,2\nB,2,1\nA,1,2\nA,1,3\nB,2,1\n", {}, {"cost": [1, 2, 1], "mass": [2, 1, 3]}),
    "prototypes of an export": (EXPORT, {"objectives": ["f1", "f2"]}, {"f1": [1, 2, 3], "f2": [2, 1, 3]}),
    "no feasible test": ("a,b,status,violated,reason,pareto\n1,2,failed,,,False\n", {"objectives": ["a"]}, "none of its 1 row counts: not feasible"),
}  # fmt: skip


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return tmp_path_factory.mktemp("source") / "designs"


@pytest.fixture
def read(path):
    def read(text, formulation=None, **options):
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return read_table(path, formulation, **options)

    return read


def objectives(table):
    """The numbers of the designs that count, by objective."""
    table = table.take(table.feasible())
    return {name: table.column(name).tolist() for name in table.schema.objectives}


@pytest.mark.parametrize("name", FILES)
def test_a_file_is_read_right_or_refused(read, name):
    content, options, expected = FILES[name]
    asked = {
        name: options[name] for name in ("objectives", "maximize", "limits") if name in options
    }
    options = {name: value for name, value in options.items() if name not in asked}
    if isinstance(expected, str):
        refused(expected, read, content, Formulation(**asked), **options)
    else:
        assert objectives(read(content, Formulation(**asked), **options)) == expected


# Which columns are what


@pytest.mark.parametrize(
    ("text", "expected", "label"),
    [
        (",cost,mass\n0,1.5,30\n1,2,3\n", ("cost", "mass"), "index"),
        ("cost,mass,ID,remark\n1.5,30,7,a\n2,3,8,b\n", ("cost", "mass"), "ID"),
        (
            "cost,mass,mu1,rank,trial,pareto\n1.5,30,1,6,2,True\n",
            ("cost", "mass", "mu1", "rank", "trial"),
            "row",
        ),
        ("place,cost,mass\nBonn,1.5,30\nUlm,2,3\n", ("cost", "mass"), "place"),
        ("mass,f1,cost\n30,1.5,1.5\n3,2,2\n", ("mass", "f1", "cost"), "row"),
        ("row,Variante,a,b\n2,V2,2,1\n1,V1,1,4\n", ("a", "b"), "Variante"),
        ("Variante,a,b\nV1,2,1\nV1,1,4\n", ("a", "b"), "row"),  # names tell designs apart
        ("material,a,b\niron,1,4\nwood,2,1\niron,3,0\ntin,4,0\n", ("a", "b"), "row"),
        ("material,a,b,id\niron,1,4,7\nwood,2,1,9\n", ("a", "b"), "material"),
        ("material,a,b,id\niron,1,4,7\niron,2,1,9\n", ("a", "b"), "id"),
        ("No.,Masse,NO\n7,1,4\n8,2,1\n", ("Masse", "NO"), "No."),
        ("number,name,a,b\n1,X,1,4\n2,Y,2,1\n3,Z,3,0\n", ("a", "b"), "name"),
        ("number,Typ,a,b\n1,X,1,4\n2,Y,2,1\n3,Z,3,0\n", ("a", "b"), "Typ"),
        ("number,a,b\n50,4,1\n20,9,2\n10,12,0\n", ("a", "b"), "number"),
        ("car,a,design,b\nTown,20,70,5\nLane,24,70,6\n", ("a", "b"), "car"),
        ("who,a,design,b\nAnn,7,85,5\nBob,9,92,6\nCem,8,78,4\n", ("a", "b"), "who"),
        ("Sample,a,NO\n3,1,4\n1,2,5\n2,3,1\n", ("a", "NO"), "Sample"),
        ("NO,a\n30,1\n10,2\n20,3\n", ("NO", "a"), "row"),
        ("car,a,design,b\nTown,20,6,5\nLane,24,7,6\nPass,21,9,4\n", ("a", "b"), "car"),
        ("Rang,Typ,a,b\n1,X,1,4\n2,Y,2,1\n3,Z,3,0\n", ("Rang", "a", "b"), "row"),
        ("f1,name,f2\n1,X,3\n2,Y,2\n3,Z,1\n", ("f1", "f2"), "name"),
        ("x1,x2,f1,f2\n1,Alu,1,4\n2,Oak,2,1\n3,Tin,3,0\n", ("f1", "f2"), "row"),
        ("x1,f1,f2\n05,1,4\n10,2,1\n", ("f1", "f2"), "row"),
        ("run,start,a,b\n1,08,1,4\n2,09,2,1\n3,10,3,0\n", ("a", "b"), "run"),
        ("Pos.,Typ,a,b\n1,X,1,4\n2,Y,2,1\n", ("a", "b"), "Typ"),
        ("name,mu1,mu2,mu3\nA,0.2,0.3,0.1\nB,0.3,0.1,0.2\n", ("mu1", "mu2", "mu3"), "name"),
        ("article,a,b\n00712,2,1\n1002,1,4\n", ("a", "b"), "article"),
    ],
)
def test_labels_and_rankings_are_no_objectives(read, text, expected, label):
    table = read(text)
    assert (table.schema.objectives, table.schema.label) == (expected, label)
    assert table.numbers.tolist() == list(range(1, len(table) + 1))


@pytest.mark.parametrize(
    ("names", "objectives", "variables"),
    [
        ("x1,f2,f1,cost", ("f2", "f1"), ("x1",)),
        ("X1,u2,F1,F2", ("F1", "F2"), ("X1", "u2")),
        ("x_1,f_1,f_2,g1", ("f_1", "f_2"), ("x_1",)),
        ("x1 [mm],f1 [kg],f2 (€),h1", ("f1 [kg]", "f2 (€)"), ("x1 [mm]",)),
        ("f1,mass,cost,g1", ("f1", "mass", "cost", "g1"), ()),
        ("f1,f2,CV,rank", ("f1", "f2"), ()),
        ("f1,f3,mass,cost", ("f1", "f3", "mass", "cost"), ()),
        ("f1,f2,g1,h1", ("f1", "f2"), ()),
        ("x1,x2,mass,cost", ("mass", "cost"), ("x1", "x2")),
        ("f1 [Hz],f2 [Hz],mass,cost", ("f1 [Hz]", "f2 [Hz]", "mass", "cost"), ()),
        ("F1,F2,mass,cost", ("F1", "F2", "mass", "cost"), ()),
    ],
)
def test_numbered_names_tell_roles(read, names, objectives, variables):
    schema = read(f"{names}\n1.5,2,3,4\n2,1,5,3\n").schema
    assert (schema.objectives, schema.variables) == (objectives, variables)


def test_names_tell_objectives_from_variables(read):
    assert read(RANKED).names == ["test 4", "test 9"]
    assert read(RANKED, Formulation(maximize=["x1"])).schema.objectives == ("x1", "f1", "f2")
    named = read(RANKED, Formulation(["x1", "f1"]), variables=["x2"]).schema
    assert (named.objectives, named.variables) == (("x1", "f1"), ("x2",))
    refused(r"formulation must be of type Formulation, got list; such as", read, RANKED, ["f3"])


OTHERS = """name,status,reason,violated,run,rank,test,pareto,mark,mass,cost
A,1,x,no,5,3,1,1,a,5,3
B,2,,no,4,2,2,0,b,4,4
C,0,z,yes,3,1,3,1,c,3,5
"""


def test_a_formulation_adds_to_that_of_a_table():
    table = TestTable.of([1, 2], [[1], [2]], [[1, 2], [2, 1]], outputs={"heat": [3, 2]})
    asked = Formulation(["f1", "r"], maximize=["f1"], computed={"r": "heat / f2"})
    both = read_table(table.under(asked), Formulation(limits="heat<=2"))
    assert both.equals(table.under(asked, limits="heat<=2"))
    schema = read_table(table.under(asked), Formulation(["f2", "f1"])).schema
    assert (schema.objectives, schema.maximize) == (("f2", "f1"), ("f1",))


def test_columns_of_others_keep_names_like_ours(read, tmp_path):
    table = read(OTHERS, Formulation(["rank", "cost"]), variables=["run"])
    assert table["status"].tolist() == [1, 2, 0]
    assert table["reason"].tolist() == ["x", "", "z"]
    assert table.under(limits="pareto<=0, violated=no").feasible().tolist() == [False, True, False]
    frame = table.to_frame()
    assert frame["pareto"].tolist() == [1, 0, 1]
    assert frame["pareto (pymoo-psi)"].tolist() == [True, True, True]
    for name in ("t.csv", "t.xlsx"):
        write_table(table, tmp_path / name)
        assert read_table(tmp_path / name).equals(table)
    read("name,status,status (pymoo-psi),a,b\nA,x,y,1,2\nB,x,z,2,1\n").to_csv(tmp_path / "t.csv")
    assert read_table(tmp_path / "t.csv")["status (pymoo-psi)"].tolist() == ["y", "z"]
    write_table(read("run,cost,mass\nA,1,5\nB,2,3\nC,3,1\n"), tmp_path / "s.db")
    assert len(read_table(tmp_path / "s.db")) == 3
    refused(
        "a column of a study must be named unlike .* got 'run'",
        write_table,
        table.under(objectives=["mass", "cost"]),
        tmp_path / "r.db",
    )


@pytest.mark.parametrize(
    ("text", "asked", "variables", "names"),
    [
        ("a,b\n1,2\n2,1\n", [], [], ["row 1", "row 2"]),
        ("id,a,b\n7,1,2\nB,2,1\n", [], [], ["id 7", "B"]),
        ("id,a,b\n007,1,2\n8,2,1\n", [], [], ["id 007", "id 8"]),
        ("id,cost,mass\n1.1,1,2\n1.1,1,2\n1.10,1,2\n", [], [], ["id 1.1", "id 1.10"]),
        (
            "car,price,range\nA,1,9\nB,2,7\nC,3,5\nB,4,3\n",
            [],
            [],
            [f"row {k}" for k in range(1, 5)],
        ),
        (EXPORT, ["f1", "f2"], [], ["number 5", "number 7", "number 8"]),
        (
            EXPORT.replace("number", "test_point"),
            ["f1", "f2"],
            [],
            ["test point 5", "test point 7", "test point 8"],
        ),
        ("row,a\n2.5,3\n1,4\n", ["row", "a"], [], ["design 1", "design 2"]),
        ("row,a\n2.5,3\n1,4\n", ["a"], ["row"], ["design 1", "design 2"]),
    ],
)
def test_designs_are_called_by_their_labels_or_rows(read, text, asked, variables, names):
    assert read(text, Formulation(asked), variables=variables).names == names


PRUNED = "id,x,f1,f2,state\n1,1,5,5,done\n2,2,4,6,done\n3,2,,,pruned\n4,3,3,7,done\n"
FAILURES = ["TrialState.FAIL", "PRUNED", "Error: 3", "not converged", "timed out (600 s)", "abgebrochen",
            "solver diverged", "RUN_FAILED", "infeasible"]  # fmt: skip


@pytest.mark.parametrize(
    ("text", "asked", "options", "remarks"),
    [
        ("Los,a\n7,3\n8,4\n9,4\n", {}, {}, ["counts the rows"]),
        ("area,a\n8,3\n7,4\n9,4\n", {}, {}, []),
        ("Versuch,a\n7,3\n8,4\n8,5\n", {}, {}, []),
        ("Trial,a,b\n3,3,1\n1,4,0\n2,4,2\n", {}, {}, []),
        ("a,No,b\n3,3,1\n1,1,0\n2.5,2,2\n", {}, {}, ["^Not ranked: No; to rank by others, name the objectives.$"]),
        ("who,a,test,b\nAnn,7,85,5\nBob,9,92,6\nCem,1,78,4\n", {}, {}, ["^Not ranked: test;"]),
        ("name,index,a,b\nA,85,3,1\nB,92,4,0\nC,78,4,2\n", {}, {}, ["^Not ranked: index;"]),
        ("x1,f1,f2,g1,h1\n1,3,1,-1,0\n2,1,3,0.5,0.1\n", {}, {},
         ["^g1 is no constraint; 1 design .* --limits 'g1<=0'", "--limits '-0.0001<=h1<=0.0001'"]),
        ("O'Neil (max),b\n1,2\n3,1\n", {}, {}, ["--maximize 'O'\"'\"'Neil \\(max\\)', or"]),
        ("x1,f1,f2,g1\n1,3,1,-1\n2,1,3,0.5\n", {"limits": "g1<=1"}, {}, []),
        (f"x1,f1,f2,{','.join(WIDE[:8])},g1\n1,3,1{',5' * 8},-1 kg\n", {}, {}, ["^Not ranked: c0, .*, c5 and 3 more; to rank"]),
        ("material,price,range\ntin,1,9\nB,2,7\ntin,3,5\nB,6,3\n", {}, {}, []),
        ("car,price,design,range\nA,1,7,9\nB,2,9,7\nC,3,9,5\n", {}, {}, ["price, .*counts the rows", "^Not ranked: design;"]),
        ("car,price,design,range\nA,1,7,9\nB,5,8,7\nC,3,9,5\n", {}, {}, ["^Not ranked: design;"]),
        ("car,id,a,b\nA,3,7,9\nB,19,8,7\nC,17,6,5\n", {}, {}, []),
        ("car,number,a,b\nA,1,7,9\nB,2,8,7\nC,3,6,5\n", {}, {}, []),
        ("Rang,car,a,b\n1,A,7,9\n2,B,8,7\n3,C,6,5\n", {}, {}, ["^Rang, .*counts the rows"]),
        ("width,height,f1,f2\n1,4,7,9\n3,2,8,7\n", {}, {}, ["^Not ranked: width and height;"]),
        ("x1,f1,f2,c,d,price\n1,3,1,3,01,$5\n2,1,3,9,02,$6\n", {}, {}, ["^Not ranked: c, d and price;"]),
        ("article,a,b\n00712,6,9\n1002,5,7\n", {}, {}, ["^Not ranked: article;"]),
        ("site,zip,a,b\nA,01067,6,9\nB,80331,5,7\n", {}, {}, ["^Not ranked: zip;"]),
        ("car,price,time,range\nA,1,1:30,9\nB,2,0:45,7\n", {}, {}, ["time holds times"]),
        (workbook([["n", "eff", "cost"], ["A", 0.85, 3], ["B", 85, 2], ["C", 0.7, 0]], edit=in_per_cent), {}, {},
         ["^eff has hundredths where the workbook shows per cent.$"]),
        ("car,price ↓,top speed (max)\nA,1,7\nB,2,8\n", {}, {},
         [r"^top speed \(max\) is minimised unless you say --maximize 'top speed \(max\)', or"]),
        ("name,location,a,b\nA,Building 1,6,9\nB,Building 2,5,7\n", {}, {}, []),
        ("car,steel,begun,a,b\nA,S235,2026-05-01,6,9\nB,S355,2026-05-02,5,7\n", {}, {}, []),
        ("a,b\n1,2\n1,3\n1,2\n", {}, {}, ["^1 row left out: equal to another one in all cells.$"]),
        ("a,b,status,violated,reason,pareto\n1,2,ok,,,\n0,x,infeasible,,,\n2,,ok,,,\n,,failed,,,\n",
         {"objectives": ["a", "b"]}, {"drop_incomplete": True},
         ["^2 rows left out: not feasible.$",
          r"^1 incomplete design left out, the first in row 3 \(line 4\).$"]),
        (STATUS, {"objectives": ["mass"]}, {},
         ["^2 designs with failed and timeout as status; to leave them out, say "
          "--limits status=ok, or limits= in Python.$"]),
        (STATUS, {"objectives": ["mass"], "limits": "status=ok"}, {}, []),
        ("a,b,state of test\n1,5,\n2,4,ok\n3,1,failed\n", {"objectives": ["a", "b"]}, {}, ["--limits 'state of test in ok, ', or limits="]),
        ("m,a,b\nA,2,1\nA,3,\nB,4,5\n", {"objectives": ["a", "b"]}, {"average_by": "m", "drop_incomplete": True},
         ["2 designs, 3 tests", "as they have no values: 1 test"]),
        (PRUNED, {"objectives": ["f1", "f2"]}, {"variables": ["x"], "drop_incomplete": True},
         [r"^1 incomplete design left out, the first in row 3 \(line 4\).$"]),
        (PRUNED, {"objectives": ["f1", "f2"], "limits": "state=done"}, {"variables": ["x"]}, []),
        *((f"a,b,state\n7,2,done\n2,1,{word}\n3,0,\n", {}, {},
           [f"^1 design with {re.escape(word)} as state; .*state in done, "]) for word in FAILURES),
        *((f"a,b,state\n1,2,done\n2,1,{word}\n", {}, {}, []) for word in ["no error", "no errors found", "fail-safe", "terror", "Ohne Fehler"]),
    ],
)  # fmt: skip
def test_remarks_say_what_was_left_out_or_may_be_no_design(read, text, asked, options, remarks):
    table = read(text, Formulation(**asked), **options)
    assert len(table.remarks) == len(remarks)
    assert all(map(re.search, remarks, table.remarks))


def test_only_columns_that_are_needed_must_be_readable(read):
    text = "a;b;c;steel\n1;2;1.250;1.4301a\n2;1;980;1.4301b\n"
    asked = Formulation(["a", "ratio"], computed={"ratio": "a / b"}, limits={"b": 1.5})
    table = read(text, asked)
    assert table.status.tolist() == ["infeasible", "ok"]
    assert table["c"].tolist() == ["1.250", "980"]
    assert table["steel"].tolist() == ["1.4301a", "1.4301b"]
    refused(
        "'1.250' in the column 'c', either 1250 or",
        read,
        text,
        Formulation(["a", "b"], limits={"c": 1000}),
    )


# Sources of other kinds


def test_every_source_gives_the_same_table(tmp_path):
    table = investigate(VectorizedSphereChute(0.4, omega0=(0, -30, 0)), 64)
    table.to_csv(tmp_path / "t.csv")
    asked = Formulation(["f2", "f1"], limits={"f3": float(np.median(table.F[:, 2]))})
    for source in (tmp_path / "t.csv", table):
        assert read_table(source, asked).equals(table.under(asked))
    table.to_frame().to_csv(tmp_path / "frame.csv")
    for source in (tmp_path / "frame.csv", table.to_frame()):
        again = read_table(source, Formulation(["f2", "f1"]))
        kept = table.take(table.status == "ok")
        np.testing.assert_array_equal(again.numbers, kept.numbers)
        np.testing.assert_array_equal(again.F, kept.F[:, [1, 0]])
        np.testing.assert_array_equal(again.X, kept.X)
    refused("variables must be left out for a table", read_table, table, variables=["x1"])
    refused("left out for data in Python", read_table, pd.DataFrame(COST), skip_rows=[1])


def test_objects_of_json_are_designs(tmp_path):
    stamps = pd.DatetimeIndex(["2026-01-02 03:04:05", "2026-01-03 00:00:01"])
    frame = pd.DataFrame({**COST, "begun": stamps, "took": stamps - stamps[0]})
    table = read_table(frame, Formulation(["cost", "mass"]))
    assert table.to_frame()["begun"].tolist() == ["2026-01-02 03:04:05", "2026-01-03 00:00:01"]
    (tmp_path / "set.json").write_text(frame.to_json(orient="records", date_format="iso"))
    np.testing.assert_array_equal(read_table(tmp_path / "set.json").F, table.F)


NAMED = pd.DataFrame({"kind": [*"WXYZ"], "a": [0, 1, 2, 3], "b": [3, 2, 1, 0]})
OBJECTS = {"a": [Decimal("1.50"), Decimal(3)], "b": [np.int64(2), np.float32(1)]}
FRAME = pd.DataFrame({"kind": ["p", "q"], "a": [1, 2], "b": [3.0, None]}, index=["A", "B"])


@pytest.mark.parametrize(
    ("source", "objectives", "names", "F"),
    [
        (np.array([[1.0, 2.0], [2.0, 1.0]]), (), ["row 1", "row 2"], [[1, 2], [2, 1]]),
        ([[3], [4]], (), ["row 1", "row 2"], [[3], [4]]),
        (FRAME, (), ["A", "B"], [[1, 3]]),
        (pd.DataFrame(OBJECTS, dtype=object), (), ["row 1", "row 2"], [[1.5, 2], [3, 1]]),
        (NAMED.iloc[[3, 0]], (), ["Z", "W"], [[3, 0], [0, 3]]),
        (NAMED[::2], (), ["W", "Y"], [[0, 3], [2, 1]]),
        (FRAME.fillna(2).set_index([["A", "B"], [0, 1]]), (), ["A, 0", "B, 1"], [[1, 3], [2, 2]]),
        (NAMED[["a", "b"]].iloc[[3, 0]], (), ["index 3", "index 0"], [[3, 0], [0, 3]]),
        # The name of its index is that of a column that follows from others.
        (
            read_table([[1.0, 2.0], [2.0, 1.0]]).ranking().to_frame().set_index("place"),
            ("f1", "f2"),
            ["row 1", "row 2"],
            [[1, 2], [2, 1]],
        ),
        (pd.DataFrame(np.ones((2, 2))), (), ["row 1", "row 2"], [[1, 1], [1, 1]]),
    ],
)
def test_arrays_and_frames(source, objectives, names, F):
    table = read_table(source, Formulation(objectives), drop_incomplete=True)
    assert table.names == names
    assert table.F[table.status == "ok"].tolist() == F
    assert "index" not in str(table.remarks)  # nobody ranks by the index of a sorted frame


@pytest.mark.parametrize(
    ("source", "message"),
    [
        (FRAME, "row 2 holds no number in the column 'b'"),
        (np.zeros(3), "source must be"),
        (FRAME[:0], "source must be"),
        (pd.DataFrame([[1, 2]], columns=["a", "a"]), "source must be"),
        (pd.DataFrame([[1, 2]], columns=[("a", "b"), "a b"]), "different names"),
        (Result(), "a result of pymoo with designs"),
    ],
)
def test_what_holds_no_designs_is_refused(source, message):
    refused(message, read_table, source)


@pytest.mark.parametrize(
    ("tables", "name"),
    [
        (["studies", "trial_values"], "Optuna"),
        (["driver_iterations"], "OpenMDAO"),
        (["costs"], "another program, with the tables costs"),
    ],
)
def test_databases_of_others_are_named(study_file, tables, name):
    """Optuna and OpenMDAO have these tables, among others."""
    sql(study_file, *(f"CREATE TABLE {table} (a)" for table in tables))
    message = (
        f"no study of pymoo-psi, but a database of {name}; .* export it as CSV by .*{study_file}"
    )
    refused(message, read_table, study_file)


RUNS = pd.DataFrame(
    {
        "material": ["a", "a", "b", "b"],
        "width": [1, 1, 1, 2],
        "mass": [1.0, 1.2, 2.0, 3.0],
        "cost": [3.0, 3.1, 2.0, 1.0],
    }
)
GROUPS = RUNS.groupby(["material", "width"])


@pytest.mark.parametrize(
    ("frame", "objectives"),
    [
        (GROUPS.mean(), ["mass", "cost"]),
        (GROUPS.agg(["mean", "max"]), ["mass mean", "mass max", "cost mean", "cost max"]),
    ],
)
def test_grouped_frames_have_their_keys_as_variables(frame, objectives):
    table = read_table(frame)
    assert [*table.schema.objectives] == objectives
    assert table.schema.variables == ("material", "width")
    assert table.names == ["a, 1", "b, 1", "b, 2"]
    assert table.X.tolist() == [["a", 1], ["b", 1], ["b", 2]]
    np.testing.assert_allclose(table[objectives[0]], [1.1, 2, 3])
    halves = RUNS.groupby(pd.cut(RUNS["mass"], 2), observed=False)[["mass", "cost"]].mean()
    assert read_table(halves).schema.objectives == ("mass", "cost")


@pytest.mark.parametrize(
    ("text", "marks", "row"),
    [
        (
            "n;a;eff;name\nA;1.250,5;81,5 %;1%\nB;980,25;79 %;2%\nC;1.000,125;80 %;3%\n",
            (",", ";", {"eff": "%"}),
            "1;1250,5;81,5;A;1%;ok;;;False",
        ),
        ("a\tb\n1.5\t2\n2.5\t1\n", (".", "\t", {}), "1\t1.5\t2.0\t1\tok\t\t\tTrue"),
    ],
)
def test_results_keep_the_marks_of_their_source(read, tmp_path, text, marks, row):
    table = read(text)
    table.to_csv(tmp_path / "t.csv")
    assert (tmp_path / "t.csv").read_text().splitlines()[1] == row
    again = read_table(tmp_path / "t.csv")
    assert again.equals(table)
    assert (again.decimal, again.separator, again.schema.units) == marks


def test_a_pipe_is_read_to_its_end(tmp_path):
    """A pipe cannot be opened twice; 300 designs are more than a buffer of 4096 bytes holds."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    text = "cost,mass\n" + "".join(f"{i / 7},{(300 - i) / 3}\n" for i in range(300))
    writer = threading.Thread(target=lambda: pipe.write_text(text))
    writer.start()
    table = read_table(pipe)
    writer.join()
    assert len(table) == 300


# Numbers of a country's style, and what must come of them: themselves or a refusal


@st.composite
def styles(draw):
    """The text of a file, the numbers in it by column, their decimal mark and the encoding."""
    decimal = draw(st.sampled_from(".,"))
    separator = draw(st.sampled_from(";\t|" + ("," if decimal == "." else "")))
    thousands = draw(st.sampled_from(["", ",", " ", "'"] if decimal == "." else ["", ".", " "]))
    n, m = draw(st.integers(1, 6)), draw(st.integers(2, 4))
    minus, quoted = draw(st.sampled_from("-−")), draw(st.booleans())
    columns, texts = {}, []
    for j in range(m):
        digits, values, cells = draw(st.integers(0, 4)), [], []
        for _ in range(n):
            whole, fraction = draw(st.integers(0, 10**7)), draw(st.integers(0, 10**digits - 1))
            sign, tail = draw(st.sampled_from(["", minus])), f"{fraction:0{digits}d}"[:digits]
            grouped = f"{whole:,}".replace(",", thousands)
            values.append(float(Decimal(f"{'-' if sign else ''}{whole}.{tail or 0}")))
            cell = f"{sign}{grouped}{decimal if tail else ''}{tail}"
            cells.append(f'"{cell}"' if quoted or separator in cell else cell)
        columns[f"c{j}"] = values
        texts.append(cells)
    lines = [separator.join(columns), *(separator.join(row) for row in zip(*texts, strict=True))]
    assume(len({*lines}) == len(lines))  # equal rows count once
    end = draw(st.sampled_from(["\n", "\r\n"]))
    title = draw(st.sampled_from(["", f"# made in May{end}"]))
    encoding = draw(st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "cp1252"]))
    return title + end.join(lines) + end, columns, decimal, encoding


@examples(2)
@given(style=styles(), told=st.booleans())
def test_what_is_read_is_what_was_written(path, style, told):
    text, columns, decimal, encoding = style
    options = {}
    if told:
        options = {"decimal": decimal, "encoding": encoding}
        text = text.replace("−", "-")
    path.write_bytes(text.encode(encoding, "replace"))
    try:
        table = read_table(path, Formulation(objectives=[*columns]), **options)
    except PsiError:
        assert not told
        return
    assert {name: table.column(name).tolist() for name in columns} == columns


@given(
    text=st.one_of(
        st.binary(max_size=200),
        st.text("ab01,.;\t|\"'# -%€\n\r{}[]:", max_size=200).map(str.encode),
        st.text(max_size=100).map(lambda text: text.encode("utf-16", "surrogatepass")),
    ),
    decimal=st.sampled_from([None, ".", ","]),
)
def test_any_file_gives_numbers_or_a_message(path, text, decimal):
    path.write_bytes(text)
    with suppress(PsiError):
        assert np.isfinite(read_table(path, decimal=decimal).F).all()


@pytest.mark.parametrize(
    ("X", "variables"),
    [
        ([[3.0, 4.0], [4.0, 1.0]], ("x1", "x2")),
        ([{"width": 3, "wood": "oak"}, {"width": 4, "wood": "ash"}], ("width", "wood")),
    ],
)
def test_results_of_pymoo_are_sources(X, variables):
    result = Result()
    result.opt = Population.new(X=np.array(X), F=np.array([[1.0, 2.0], [2.0, 1.0]]))
    table = read_table(result)
    assert (table.schema.objectives, table.schema.variables) == (("f1", "f2"), variables)
    np.testing.assert_array_equal(table.F, [[1.0, 2.0], [2.0, 1.0]])
    assert table.X.tolist() == [[*x.values()] if isinstance(x, dict) else x for x in X]


@pytest.mark.parametrize("least", [0.3, 3.0])
def test_results_of_pymoo_keep_feasibility(least):
    """Two constraints that the first of them makes infeasible for a large number."""

    def bounded(x):
        return {"F": [x[0], 1 - x[0]], "G": [least - x[0]], "H": [min(0.0, x[0] - 0.5)]}

    problem = Model(bounded, n_var=1, n_ieq_constr=1, n_eq_constr=1)
    result = minimize(
        problem, NSGA2(pop_size=10), ("n_gen", 3), seed=1, return_least_infeasible=True
    )
    for source, individuals in ((result, result.opt), (result.pop, result.pop),
                                (result.algorithm, result.opt)):  # fmt: skip
        table = read_table(source)
        assert table.schema.constraints == ("g1", "h1")
        assert table.feasible().tolist() == individuals.get("FEAS")[:, 0].tolist()
        np.testing.assert_array_equal(table.G, individuals.get("G"))
        np.testing.assert_array_equal(table.H, individuals.get("H"))
    if least > 1:
        refused("a result of pymoo with feasible designs, got infeasible", explain, result, 0)
